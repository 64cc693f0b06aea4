// SPDX-License-Identifier: Apache-2.0
// The frame `odom`: continuous, because it integrates relative motion only. Corrections of the map, its unit
// included, go into map_from_odom. A new map raises the reset counter.
#pragma once

#include <cstdint>

#include "slam/geometry/se3.h"

namespace farpoint::slam {

class Odometry {
 public:
  // The body moved to this pose of the map. Adds the motion since the pose before, across lost frames too:
  // both poses are of the same map.
  void advance(const SE3& T_map_body);
  // The map moved under the body: both poses are one, before and after the correction. `scale`: new map units
  // in an old one. odom keeps its pose and its unit.
  void correct(const SE3& T_map_body_before, const SE3& T_map_body_after, double scale = 1.0);
  // A new map has another origin and unit. The reset counter rises, since the motion from the old map's last
  // pose to the first of the new one is unknown.
  void begin_map() {
    ++resets_;
    has_last_ = false;
    map_units_ = 1.0;
  }

  [[nodiscard]] const SE3& T_odom_body() const { return T_odom_body_; }
  // At this pose of the map.
  [[nodiscard]] Sim3 map_from_odom(const SE3& T_map_body) const;
  [[nodiscard]] std::uint32_t reset_counter() const { return resets_; }

 private:
  SE3 T_odom_body_;
  SE3 T_map_body_last_;
  bool has_last_ = false;
  double map_units_ = 1.0;  // in a unit of odom
  std::uint32_t resets_ = 0;
};

}  // namespace farpoint::slam
