// SPDX-License-Identifier: Apache-2.0
#include "drivers/can/wheel_writer.h"

#include <algorithm>
#include <utility>

namespace farpoint::drivers {

WheelWriter::WheelWriter(const std::string& dbc_path, const std::string& names) {
  for (WheelSignal& signal : read_wheel_signals(dbc_path, names)) {
    const auto known = std::find_if(frames_.begin(), frames_.end(),
                                    [&](const ipc::CanFrame& frame) { return frame.id == signal.dbc.id; });
    const auto at = static_cast<std::size_t>(known - frames_.begin());
    if (known == frames_.end()) {
      ipc::CanFrame& frame = frames_.emplace_back();
      frame.id = signal.dbc.id;
      frame.size = static_cast<std::uint8_t>(signal.dbc.size);
    }
    (void)signal.dbc.put(0.0, &frames_[at]);  // a range that leaves 0 out begins with its nearest
    wheels_.push_back({std::move(signal), at});
  }
}

std::span<const ipc::CanFrame> WheelWriter::frames(const wheels_t& message) {
  const std::size_t count = std::min(wheels_.size(), message.wheel_speed.size());
  for (std::size_t i = 0; i < count; ++i) {
    const Wheel& wheel = wheels_[i];
    const double physical = message.wheel_speed[i] / wheel.signal.to_m_s;
    if (!wheel.signal.dbc.put(physical, &frames_[wheel.frame])) ++limited_;
  }
  return frames_;
}

bool WheelWriter::needs_fd() const {
  constexpr std::uint8_t kClassicBytes = 8;
  return std::any_of(frames_.begin(), frames_.end(),
                     [](const ipc::CanFrame& frame) { return frame.size > kClassicBytes; });
}

}  // namespace farpoint::drivers
