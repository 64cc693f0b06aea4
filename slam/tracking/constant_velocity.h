// SPDX-License-Identifier: Apache-2.0
// The motion model of frames alone: the body goes on as it moved between the last two accepted frames.
#pragma once

#include <cstdint>

#include "slam/geometry/motion_model.h"
#include "slam/map/local_view.h"

namespace farpoint::slam {

// Pose and velocity of the body at a time.
struct Motion {
  SE3 T_world_body;
  std::int64_t utime = 0;  // microseconds, clock of the frames
  Vector6d velocity =
      Vector6d::Zero();  // body axes; translation (map units a second), rotation (rad a second)
  bool has_velocity = false;

  // The pose `dt_s` seconds later, along the arc of the velocity.
  [[nodiscard]] SE3 extrapolated(double dt_s) const;
};

[[nodiscard]] double seconds_between(std::int64_t from_utime, std::int64_t to_utime);

// Two motions: the newest, and the last confirmed one. They differ while the newest pose is on trial: found
// after a loss, and not yet supported by a second frame. Tracking's thread; makes no heap call.
class ConstantVelocity final : public MotionModel {
 public:
  // Longest time between two frames over which the mean velocity is used as a prior.
  static constexpr double kLongestStep_s = 1.0;
  // The same after a gap.
  static constexpr double kLongestGap_s = 3.0;

  // Forgets everything: a new map begins at this pose, without a velocity.
  void start(const SE3& T_world_body, std::int64_t utime);
  // Applies the correction of a newer view of the same map, scale included. Poses and velocities follow the
  // newest keyframe that both views contain. Returns the scale: new map units in an old one; 1 where the
  // views share no keyframe.
  double correct(const LocalView& before, const LocalView& after);
  // Takes a pose as newest and confirmed.
  void accept(const SE3& T_world_body, std::int64_t utime);
  // Takes a pose as newest only; its velocity is measured from the confirmed pose.
  void accept_on_trial(const SE3& T_world_body, std::int64_t utime);

  // The body moved on unseen, until `utime`: the confirmed pose moves with it and is the newest one.
  void carry(const SE3& T_from_to, std::int64_t utime);

  // The newest pose moved on by its velocity, without information. The newest pose itself where there is no
  // velocity, or `utime` lies before it or more than kLongestStep_s after it.
  [[nodiscard]] PosePrior predict(std::int64_t utime) const override;
  [[nodiscard]] Vector6d velocity_body() const override { return newest_.velocity; }

  [[nodiscard]] const Motion& newest() const { return newest_; }
  [[nodiscard]] const Motion& confirmed() const { return confirmed_; }

 private:
  Motion newest_, confirmed_;
};

}  // namespace farpoint::slam
