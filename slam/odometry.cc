// SPDX-License-Identifier: Apache-2.0
#include "slam/odometry.h"

namespace farpoint::slam {

void Odometry::advance(const SE3& T_map_body) {
  if (has_last_) T_odom_body_ = T_odom_body_ * (T_map_body_last_.inverse() * T_map_body);
  T_map_body_last_ = T_map_body;
  has_last_ = true;
}

void Odometry::correct(const SE3& T_map_body_before, const SE3& T_map_body_after) {
  if (has_last_) T_map_body_last_ = T_map_body_after * (T_map_body_before.inverse() * T_map_body_last_);
}

Sim3 Odometry::map_from_odom(const SE3& T_map_body) const {
  const SE3 map_from_odom = T_map_body * T_odom_body_.inverse();
  return Sim3{1.0, map_from_odom.q, map_from_odom.t};
}

}  // namespace farpoint::slam
