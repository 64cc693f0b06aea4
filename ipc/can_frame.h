// One classic CAN frame, apart from linux/can.h so that codec and logs build anywhere.
#pragma once

#include <array>
#include <cstdint>

namespace farpoint::ipc {

struct CanFrame {
  std::uint32_t id = 0;   // 11 bits
  std::uint8_t size = 8;  // bytes of data, 0..8
  std::array<std::uint8_t, 8> data{};
};

}  // namespace farpoint::ipc
