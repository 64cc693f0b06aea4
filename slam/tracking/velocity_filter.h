// SPDX-License-Identifier: Apache-2.0
// The body's velocity at the newest frame, from the motions between frames: a Kalman filter whose
// acceleration changes by white jerk. No difference of two poses, which is half a period late.
#pragma once

#include <array>
#include <cstdint>

#include "slam/geometry/covariance.h"

namespace farpoint::slam {

// One filter an axis of the body, each of three numbers: how far the last pose is off, velocity,
// acceleration. Tracking's thread; makes no heap call.
class VelocityFilter {
 public:
  // Longest time between two frames that the filter spans. After a longer one it begins anew.
  static constexpr double kLongest_s = 1.0;

  // Forgets everything.
  void clear();
  // The body moved by T_before_now in `dt_s`. `noise`: variances of the newest pose against the one before,
  // order (translation, rotation). `metre`: map units in a metre, of which an estimate is good enough.
  void advance(const SE3& T_before_now, double dt_s, const Vector6d& noise, double metre);
  // The unit of the map changed: `factor` new ones in an old one.
  void change_unit(double factor);

  // Body axes at the newest frame: translation (map units a second), rotation (rad a second). Zero before
  // the first motion.
  [[nodiscard]] Vector6d velocity() const;
  // Axes are independent. Unknown before the first motion.
  [[nodiscard]] Matrix6d covariance() const;

 private:
  struct Axis {
    Eigen::Vector3d x = Eigen::Vector3d::Zero();
    Eigen::Matrix3d P = Eigen::Matrix3d::Zero();
  };
  void begin(const Vector6d& moved, double dt_s, const Vector6d& noise, double metre);

  std::array<Axis, 6> axes_;
  bool begun_ = false;
};

}  // namespace farpoint::slam
