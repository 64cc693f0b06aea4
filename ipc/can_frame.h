// One CAN frame, apart from linux/can.h so that codec and logs build anywhere.
#pragma once

#include <array>
#include <cstdint>

namespace farpoint::ipc {

struct CanFrame {
  std::uint32_t id = 0;   // 11 bits
  std::uint8_t size = 8;  // bytes of data: classic 0..8, CAN FD 0..64
  std::array<std::uint8_t, 64> data{};
};

}  // namespace farpoint::ipc
