// SPDX-License-Identifier: Apache-2.0
#include "slam/odometry.h"

namespace farpoint::slam {

void Odometry::advance(const SE3& T_map_body) {
  if (has_last_) {
    SE3 motion = T_map_body_last_.inverse() * T_map_body;
    motion.t /= map_units_;
    T_odom_body_ = T_odom_body_ * motion;
  }
  T_map_body_last_ = T_map_body;
  has_last_ = true;
}

void Odometry::correct(const SE3& T_map_body_before, const SE3& T_map_body_after, double scale) {
  map_units_ *= scale;
  if (!has_last_) return;
  SE3 T_before_last = T_map_body_before.inverse() * T_map_body_last_;
  T_before_last.t *= scale;
  T_map_body_last_ = T_map_body_after * T_before_last;
}

Sim3 Odometry::map_from_odom(const SE3& T_map_body) const {
  SE3 T_body_odom = T_odom_body_.inverse();
  T_body_odom.t *= map_units_;
  const SE3 map_from_odom = T_map_body * T_body_odom;
  return Sim3{map_units_, map_from_odom.q, map_from_odom.t};
}

}  // namespace farpoint::slam
