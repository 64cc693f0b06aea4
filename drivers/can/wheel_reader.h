// SPDX-License-Identifier: Apache-2.0
// Reads wheel speeds from CAN frames, by message and signal of a DBC file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "drivers/can/wheel_signals.h"
#include "ipc/message.h"

namespace farpoint::drivers {

// A message with room for the wheels of any vehicle, so that no measurement uses the heap.
[[nodiscard]] inline wheels_t wheels_with_room() {
  constexpr std::size_t kMostWheels = 4;
  wheels_t message{};
  message.wheel_speed.resize(kMostWheels);
  return message;
}

class WheelReader {
 public:
  // Arguments as for read_wheel_signals(). Throws std::runtime_error with what was expected.
  WheelReader(const std::string& dbc_path, const std::string& names);

  // Returns true when the frame completes a measurement: every wheel received since the last one. A wheel
  // 'not available' is NaN; the vehicle's speed is the mean of the others. No allocation.
  [[nodiscard]] bool take(const ipc::CanFrame& frame, std::int64_t utime, wheels_t* message);

  // Identifiers of the frames to receive.
  [[nodiscard]] std::vector<std::uint32_t> ids() const;

 private:
  struct Wheel {
    WheelSignal signal;
    double speed_m_s = 0.0;
    bool heard = false;
  };
  void give(std::int64_t utime, wheels_t* message) const;

  std::vector<Wheel> wheels_;
};

}  // namespace farpoint::drivers
