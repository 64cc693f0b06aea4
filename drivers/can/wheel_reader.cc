// SPDX-License-Identifier: Apache-2.0
#include "drivers/can/wheel_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace farpoint::drivers {
WheelReader::WheelReader(const std::string& dbc_path, const std::string& names) {
  for (WheelSignal& signal : read_wheel_signals(dbc_path, names))
    wheels_.push_back({std::move(signal), 0.0, false});
}

bool WheelReader::take(const ipc::CanFrame& frame, std::int64_t utime, wheels_t* message) {
  for (Wheel& wheel : wheels_) {
    if (wheel.signal.dbc.id != frame.id) continue;
    wheel.speed_m_s = wheel.signal.to_m_s * wheel.signal.dbc.value(frame);
    wheel.heard = true;
  }
  if (!std::all_of(wheels_.begin(), wheels_.end(), [](const Wheel& w) { return w.heard; })) return false;
  give(utime, message);
  for (Wheel& wheel : wheels_) wheel.heard = false;
  return true;
}

void WheelReader::give(std::int64_t utime, wheels_t* message) const {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  message->utime = utime;
  message->speed_sigma = -1.0;
  message->yaw_rate = message->steering_angle = kNan;
  message->nwheels = static_cast<std::int32_t>(wheels_.size());
  message->wheel_speed.resize(wheels_.size());
  double sum = 0.0;
  int known = 0;
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    message->wheel_speed[i] = wheels_[i].speed_m_s;
    if (std::isnan(wheels_[i].speed_m_s)) continue;
    sum += wheels_[i].speed_m_s;
    ++known;
  }
  message->speed = known > 0 ? sum / known : kNan;
}

std::vector<std::uint32_t> WheelReader::ids() const {
  std::vector<std::uint32_t> ids;
  for (const Wheel& wheel : wheels_)
    if (std::find(ids.begin(), ids.end(), wheel.signal.dbc.id) == ids.end())
      ids.push_back(wheel.signal.dbc.id);
  return ids;
}

}  // namespace farpoint::drivers
