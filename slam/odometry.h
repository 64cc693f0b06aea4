// SPDX-License-Identifier: Apache-2.0
// The frame `odom`: integrates relative motion, and follows the map's corrections at a bounded rate, so that
// a controller sees no step. A change of the map's unit goes into map_from_odom alone. A new map raises the
// reset counter.
#pragma once

#include <cstdint>

#include "slam/config.h"
#include "slam/geometry/se3.h"

namespace farpoint::slam {

class Odometry {
 public:
  explicit Odometry(const OdometryConfig& config) : config_(config) {}

  // The body was at this pose of the map at `utime` (microseconds). Adds the motion since the pose before,
  // across lost frames too, and a part of the map's corrections that are still missing in odom. `sigma`: of
  // the pose's position, map units. A vehicle that moves by less than the noise takes no correction.
  void advance(const SE3& T_map_body, std::int64_t utime, double sigma);
  // Another sensor tells the motion since the last pose, in odom's unit; no image does.
  void carry(const SE3& T_from_to);
  // The map shows the body again where carry() has led to. odom makes no step: what the map says otherwise
  // is a correction. advance() at the same pose follows.
  void rejoin(const SE3& T_map_body) { T_map_body_last_ = T_map_body; }
  // The map moved under the body: both poses are one, before and after the correction. `scale`: new map units
  // in an old one. odom keeps its pose and its unit.
  void correct(const SE3& T_map_body_before, const SE3& T_map_body_after, double scale = 1.0);
  // The unit of the map is odom's from this pose on: the metre was found. odom's position is expressed in it,
  // and the reset counter rises.
  void begin_unit(const SE3& T_map_body);
  // The map has settled: its corrections flow into odom from here on. Those before went into map_from_odom.
  void follow_map() { follows_ = true; }
  // A new map has another origin and unit. The reset counter rises, since the motion from the old map's last
  // pose to the first of the new one is unknown.
  void begin_map();

  // What the last advance() took of the map's corrections: squares of the parts taken one after another sum
  // up to the square of what was missing. Order (translation, rotation), body axes.
  [[nodiscard]] const Vector6d& correction() const { return correction_; }

  [[nodiscard]] const SE3& T_odom_body() const { return T_odom_body_; }
  // Pose of the map that odom has come to.
  [[nodiscard]] const SE3& T_map_body() const { return T_map_body_last_; }
  // At this pose of the map.
  [[nodiscard]] Sim3 map_from_odom(const SE3& T_map_body) const;
  [[nodiscard]] std::uint32_t reset_counter() const { return resets_; }

 private:
  [[nodiscard]] SE3 target(const SE3& T_map_body) const;
  void aim_at(const SE3& T_odom_body, const SE3& T_map_body);
  void take_corrections(const SE3& T_map_body, std::int64_t utime, double sigma);

  const OdometryConfig config_;
  SE3 T_odom_body_;
  SE3 T_map_body_last_;
  bool has_last_ = false;
  bool follows_ = false;
  double map_units_ = 1.0;  // in a unit of odom
  // Where odom would be had it followed the map at once: this, times the pose in odom's unit.
  SE3 T_odom_map_;
  // Place and time of the last correction taken: only motion beyond the noise since then allows another.
  SE3 T_odom_body_corrected_;
  std::int64_t corrected_utime_ = 0;
  Vector6d correction_ = Vector6d::Zero();
  std::uint32_t resets_ = 0;
};

}  // namespace farpoint::slam
