// SPDX-License-Identifier: Apache-2.0
// Where the body is expected at a time: what tracking starts a frame from. Constant velocity implements it
// from frames alone; slam/fusion implements it from wheels and inertial measurements.
#pragma once

#include <cstdint>

#include "slam/geometry/se3.h"

namespace farpoint::slam {

// An expected pose and how well it is known.
struct PosePrior {
  SE3 T_world_body;
  // Inverse covariance of a perturbation of the pose (se3.h; body axes, translation then rotation). Zero
  // where the prior is only a start: the pose solver then weighs images alone.
  Matrix6d information = Matrix6d::Zero();
};

class MotionModel {
 public:
  MotionModel() = default;
  MotionModel(const MotionModel&) = delete;
  MotionModel& operator=(const MotionModel&) = delete;
  virtual ~MotionModel() = default;

  // The pose of the next frame, at `utime` (microseconds, clock of the frames). Tracking's thread; makes no
  // heap call.
  [[nodiscard]] virtual PosePrior predict(std::int64_t utime) const = 0;
  // Velocity of the newest accepted frame in body axes: translation (world units a second), rotation (rad a
  // second).
  [[nodiscard]] virtual Vector6d velocity_body() const = 0;
};

}  // namespace farpoint::slam
