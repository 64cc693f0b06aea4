// SPDX-License-Identifier: Apache-2.0
#include "slam/map/wheel_motion.h"

#include <Eigen/Geometry>

namespace farpoint::slam {

void WheelMotion::append(const WheelMotion& next) {
  const Eigen::Matrix2d R = Eigen::Rotation2Dd(yaw_rad).toRotationMatrix();
  const Eigen::Vector2d step = R * next.displacement_m;
  Eigen::Matrix3d carry = Eigen::Matrix3d::Identity();
  carry.topRightCorner<2, 1>() = Eigen::Vector2d(-step.y(), step.x());
  Eigen::Matrix3d enter = Eigen::Matrix3d::Identity();
  enter.topLeftCorner<2, 2>() = R;
  covariance = carry * covariance * carry.transpose() + enter * next.covariance * enter.transpose();
  displacement_m += step;
  yaw_rad += next.yaw_rad;
  to_utime = next.to_utime;
}

}  // namespace farpoint::slam
