// SPDX-License-Identifier: Apache-2.0
// Measurements that enter the estimator, one struct a sensor. SI units. Times are microseconds in the one
// clock of the frames.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace farpoint::slam {

// One reading of the inertial measurement unit, in its own axes.
struct ImuSample {
  std::int64_t utime = 0;
  Eigen::Vector3d gyro_rad_per_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_m_per_s2 = Eigen::Vector3d::Zero();  // specific force: +g upwards at rest
};

// One reading of the wheels: motion of the body's origin along its x axis and about its z axis.
struct WheelSample {
  std::int64_t utime = 0;
  double speed_m_per_s = 0;        // forward is positive
  double yaw_rate_rad_per_s = 0;   // left is positive
  double sigma_speed_m_per_s = 0;  // 1 sigma of one reading; zero takes the receiver's own
  double sigma_yaw_rate_rad_per_s = 0;
};

}  // namespace farpoint::slam
