// SPDX-License-Identifier: Apache-2.0
// Writes wheel speeds into CAN frames, by message and signal of a DBC file. WheelReader reads the same
// frames.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/can/wheel_signals.h"
#include "ipc/message.h"

namespace farpoint::drivers {

class WheelWriter {
 public:
  // Arguments as for read_wheel_signals(). Throws std::runtime_error with what was expected.
  WheelWriter(const std::string& dbc_path, const std::string& names);

  // Returns one frame for each DBC message, in the order of the names; valid until the next call. Surplus
  // wheels are left out. A missing wheel or NaN keeps the signal's previous value, initially 0 m/s.
  [[nodiscard]] std::span<const ipc::CanFrame> frames(const wheels_t& message);

  // Speeds outside their signal's range (clamped) and NaN (left out), since the start.
  [[nodiscard]] std::uint64_t limited() const { return limited_; }
  // True if a message is longer than a classic frame.
  [[nodiscard]] bool needs_fd() const;

 private:
  struct Wheel {
    WheelSignal signal;
    std::size_t frame = 0;  // of frames_
  };
  std::vector<Wheel> wheels_;
  std::vector<ipc::CanFrame> frames_;
  std::uint64_t limited_ = 0;
};

}  // namespace farpoint::drivers
