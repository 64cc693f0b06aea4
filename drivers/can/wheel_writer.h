// Wheel speeds as CAN frames, named by message and signal of a DBC file: what WheelReader reads.
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
  // As read_wheel_signals() takes them. Throws std::runtime_error saying what was expected.
  WheelWriter(const std::string& dbc_path, const std::string& names);

  // One frame for each message of the DBC, in the order in which they are named; valid until the next call.
  // Of more wheels than signals the last ones are left out; of fewer, or not a number, signals stay as they
  // were, at first at 0 m/s.
  [[nodiscard]] std::span<const ipc::CanFrame> frames(const wheels_t& message);

  // Speeds that their signal could not hold, and that were put at its limit or, not a number, left out.
  [[nodiscard]] std::uint64_t limited() const { return limited_; }
  // Whether some message is longer than a classic frame.
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
