// SPDX-License-Identifier: Apache-2.0
// AUTOSAR E2E profile 1 for classic CAN frames (AUTOSAR "Specification of SW-C End-to-End Communication
// Protection Library", profile 1, variant 1A).
//
// Byte 0 is the CRC, the low nibble of byte 1 the counter (0..14; 15 is never sent), its high nibble is free
// for data. The CRC-8 has the polynomial 0x1D (x^8 + x^4 + x^3 + x^2 + 1), not reflected, effective start
// value 0 and final XOR 0, and runs over the Data ID's low byte, its high byte (mode BOTH), then the data
// bytes 1..7. Vectors, Data ID 0x123: bytes 1..7 all zero -> 0xCC; with counter 1 (byte 1 = 0x01) -> 0x91.
#pragma once

#include <array>
#include <cstdint>

#include "ipc/can_frame.h"

namespace farpoint::ipc {

inline constexpr std::uint8_t kE2eCounterEnd = 15;  // the counter runs 0..14

// CRC of the frame's bytes 1..size-1 with its Data ID. Precondition: frame.size in 1..8.
[[nodiscard]] std::uint8_t e2e_crc(const CanFrame& frame, std::uint16_t data_id);

// Writes counter and CRC into the frame; its other bits stay.
void e2e_protect(CanFrame* frame, std::uint16_t data_id, std::uint8_t counter);

[[nodiscard]] constexpr std::uint8_t e2e_next(std::uint8_t counter) {
  return static_cast<std::uint8_t>((counter + 1) % kE2eCounterEnd);
}

enum class E2eStatus : std::uint8_t {
  kOk,        // the counter went on by one
  kSomeLost,  // it went on by more
  kRepeated,  // it did not move
  kWrongCrc,  // or wrong counter value, length, Data ID
};

// The receiver's side: one a Data ID.
class E2eChecker {
 public:
  explicit E2eChecker(std::uint16_t data_id) : data_id_(data_id) {}
  // The first frame with a right CRC is ok whatever its counter.
  [[nodiscard]] E2eStatus check(const CanFrame& frame);

 private:
  std::uint16_t data_id_;
  int last_ = -1;
};

// AUTOSAR E2E profile 5 for CAN FD frames. Bytes 0 and 1 are the CRC, low byte first, byte 2 the counter
// (0..255). The CRC-16 has the polynomial 0x1021, not reflected, start value 0xFFFF and no final XOR. It runs
// over bytes 2..size-1, then the Data ID's low byte and its high byte. Vector: Data ID 0x1234, 8 bytes, all
// others zero -> bytes 0 and 1 are 0x1C 0xCA.

// Precondition: frame.size >= 3.
[[nodiscard]] std::uint16_t e2e5_crc(const CanFrame& frame, std::uint16_t data_id);

// Writes counter and CRC into the frame; its other bytes stay.
void e2e5_protect(CanFrame* frame, std::uint16_t data_id, std::uint8_t counter);

}  // namespace farpoint::ipc
