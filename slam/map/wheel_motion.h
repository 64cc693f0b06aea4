// SPDX-License-Identifier: Apache-2.0
// The body's motion in a plane, as wheels measure it between two times.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace farpoint::slam {

// Motion of the wheels' point of the body, in the plane of the body's x and y axes at `from_utime`.
struct WheelMotion {
  std::int64_t from_utime = 0, to_utime = 0;
  Eigen::Vector2d displacement_m = Eigen::Vector2d::Zero();
  double yaw_rad = 0;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // displacement, yaw; m^2, m rad, rad^2

  // Joins this motion with the one behind it; their errors are independent.
  // Precondition: next.from_utime == to_utime.
  void append(const WheelMotion& next);
  [[nodiscard]] double duration_s() const { return 1e-6 * static_cast<double>(to_utime - from_utime); }
};

}  // namespace farpoint::slam
