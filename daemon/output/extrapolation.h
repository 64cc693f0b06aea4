// A pose carried on to a moment after its image.
#pragma once

#include "daemon/output/pose_sink.h"

namespace farpoint::daemon {

// The frame as it will be dt_s later where the body keeps its velocity in body axes: poses moved, age and
// covariance grown. What the growth assumes (ours): the body may accelerate by 3 m/s^2 and 2 rad/s^2 (one
// sigma) meanwhile, and its velocity was found from two poses `period_s` apart, each as uncertain as this
// one. A frame without a valid pose only grows older.
[[nodiscard]] FrameOutput extrapolate(const FrameOutput& frame, double dt_s, double period_s);

}  // namespace farpoint::daemon
