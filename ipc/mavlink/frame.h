// SPDX-License-Identifier: Apache-2.0
// MAVLink framing (https://mavlink.io/en/guide/serialization.html): messages to bytes, and bytes to messages.
// No heap call, never throws.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace farpoint::ipc::mavlink {

// The messages of this project: number, bytes of the payload with extensions, and the checksum's seed, which
// depends on names and types of the message's fields (CRC_EXTRA).
struct MessageKind {
  std::uint32_t id = 0;
  std::uint8_t payload_bytes = 0;
  std::uint8_t crc_extra = 0;
};
inline constexpr MessageKind kHeartbeat{0, 9, 50}, kTimesync{111, 18, 34}, kOdometry{331, 233, 91};

inline constexpr std::size_t kMostPayload = 255;
inline constexpr std::size_t kMostFrame = 10 + kMostPayload + 2 + 13;  // with a signature

// Who sends, and of what number.
struct Sender {
  std::uint8_t system = 0, component = 0;
};

// One whole frame, version 2, unsigned.
class Frame {
 public:
  // `payload` in the order of the wire, kind.payload_bytes long. Zeros at its end are left out.
  Frame(const MessageKind& kind, const Sender& sender, std::uint8_t sequence,
        std::span<const std::uint8_t> payload);
  [[nodiscard]] std::span<const std::uint8_t> bytes() const { return {bytes_.data(), size_}; }

 private:
  std::array<std::uint8_t, kMostFrame> bytes_{};
  std::size_t size_ = 0;
};

// A message that came in. Bytes of the payload beyond its own length are zero, as the protocol has it.
struct Received {
  std::uint32_t id = 0;
  Sender sender;
  std::array<std::uint8_t, kMostPayload> payload{};
};

// Finds the frames in a stream of bytes: versions 1 and 2, signed or not (a signature is not checked). Frames
// of other messages than those above cannot be checked, since their seed is not known: they are skipped by
// their length where another frame begins behind them. After a wrong checksum the search goes on behind the
// frame's first byte.
class Parser {
 public:
  // Takes as many bytes as fit and returns their number. Call next() until it returns nothing before more
  // bytes come.
  std::size_t take(std::span<const std::uint8_t> bytes);
  // The next whole message of this project with a right checksum.
  [[nodiscard]] std::optional<Received> next();
  // Frames of known messages with a wrong checksum.
  [[nodiscard]] std::uint64_t damaged() const { return damaged_; }

 private:
  void drop(std::size_t count);

  std::array<std::uint8_t, 2 * kMostFrame> bytes_{};
  std::size_t size_ = 0;
  std::uint64_t damaged_ = 0;
};

}  // namespace farpoint::ipc::mavlink
