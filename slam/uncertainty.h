// SPDX-License-Identifier: Apache-2.0
// Follows how far `odom` may be off: noise of a pose, drift since the reset, sigma of the unit.
#pragma once

#include <cstdint>
#include <limits>

#include "slam/geometry/rig.h"
#include "slam/odometry_errors.h"
#include "slam/tracking/pose_errors.h"

namespace farpoint::slam {

// What odom took of a frame.
struct OdometryStep {
  SE3 T_odom_body;
  std::int64_t utime = 0;  // microseconds
  double map_units = 1.0;  // in a unit of odom
  // Of the map, moved odom without a motion: the part of what was missing that this frame made up for. Order
  // (translation, rotation), body axes, units of odom.
  Vector6d correction = Vector6d::Zero();
  std::uint64_t view_sequence = 0;  // of the view that the frame was tracked against
  bool metric = false;
};

// Tracking's thread; makes no heap call.
class Uncertainty {
 public:
  explicit Uncertainty(const Rig& rig);

  // A new map: nothing is known of its poses, and nothing has drifted.
  void begin_map();
  // A pose with these errors. While frames hang on the same view, what they exchange of its landmarks waits:
  // the drift rises with the next view.
  void advance(const OdometryStep& step, const PoseErrors& errors);

  [[nodiscard]] const OdometryErrors& errors() const { return errors_; }

 private:
  void begin(const OdometryStep& step);
  void grow(const OdometryStep& step, const Matrix6d& exchanged);
  [[nodiscard]] double scale_sigma(double holding_distance_m) const;

  double pair_sigma_per_m_ = std::numeric_limits<double>::infinity();
  OdometryErrors errors_;
  bool begun_ = false;
  Matrix6d waiting_ = Matrix6d::Zero();  // of the drift, axes of odom
  std::uint64_t view_sequence_ = 0;
  std::int64_t utime_ = 0;
};

}  // namespace farpoint::slam
