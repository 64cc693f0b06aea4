// SPDX-License-Identifier: Apache-2.0
// One CAN frame, apart from linux/can.h so that codec and logs build anywhere.
#pragma once

#include <array>
#include <cstdint>

namespace farpoint::ipc {

inline constexpr std::uint32_t kMaxStandardCanId = 0x7ff;       // 11 bits
inline constexpr std::uint32_t kMaxExtendedCanId = 0x1fffffff;  // 29 bits

struct CanFrame {
  std::uint32_t id = 0;
  std::uint8_t size = 8;  // bytes of data: classic 0..8, CAN FD 0..64
  std::array<std::uint8_t, 64> data{};
  bool extended = false;  // the identifier has 29 bits
};

}  // namespace farpoint::ipc
