// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/publisher.h"

#include <algorithm>

namespace farpoint::daemon {

void Publisher::on_frame(const FrameOutput& frame) {
  const std::int64_t utime = frame.result.utime;
  publish(ipc::kOdometryChannel, utime, make_odometry(frame));
  publish(ipc::kPoseChannel, utime, make_pose(frame));
  publish(ipc::kMapFromOdomChannel, utime, make_map_from_odom(frame));
  if (frame.valid) publish(ipc::kBotCorePoseChannel, utime, make_bot_core_pose(frame));
}

bool Publisher::has_logs() const {
  return std::any_of(sinks_.begin(), sinks_.end(), [](const auto& sink) { return sink->is_log(); });
}

std::uint64_t Publisher::errors(bool of_logs) const {
  std::uint64_t sum = 0;
  for (const auto& sink : sinks_) sum += sink->is_log() == of_logs ? sink->errors() : 0;
  return sum;
}

}  // namespace farpoint::daemon
