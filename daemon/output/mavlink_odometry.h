// SPDX-License-Identifier: Apache-2.0
// From the estimate to MAVLink's ODOMETRY: frames, covariances, counters, and what is not sent.
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/output/pose_sink.h"
#include "ipc/mavlink/messages.h"

namespace farpoint::daemon {

// Of the noise of one message, as autopilots take it: order translation, rotation; body axes (x forward, y
// left, z up).
struct MeasurementNoise {
  slam::Matrix6d pose = slam::Matrix6d::Zero();
  slam::Matrix6d velocity = slam::Matrix6d::Zero();
};

// Why an estimate is not sent. Autopilots take what they get for metres and for true: ArduPilot does not
// refuse a NaN, and both time out by themselves without messages.
enum class MavlinkHold : std::uint8_t {
  kNone,
  kNoPose,   // not valid, or of an image that is too old
  kNoScale,  // in map units
};
[[nodiscard]] MavlinkHold hold_of(const FrameOutput& frame, std::int64_t image_age_us);

// The frame's odometry in MAV_FRAME_LOCAL_FRD, which is `odom` turned by half a turn about x, and velocities
// in MAV_FRAME_BODY_FRD. Without noise, or where it is not finite, the covariances are unknown. The counter
// changes with each reset and each start of the daemon. Precondition: hold_of() the frame is kNone.
[[nodiscard]] ipc::mavlink::Odometry mavlink_odometry(const FrameOutput& frame,
                                                      const std::optional<MeasurementNoise>& noise,
                                                      std::uint64_t time_us);

}  // namespace farpoint::daemon
