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
  double unit_sigma = 0;  // of the metre, relative, where wheels gave it; else 0
};

// Tracking's thread; makes no heap call.
class Uncertainty {
 public:
  explicit Uncertainty(const Rig& rig);

  // The reset counter rises, by a new map or a new unit: nothing has drifted since.
  void begin();
  // A pose with these errors. While frames hang on the same view, what they exchange of its landmarks waits:
  // the drift rises with the next view.
  void advance(const OdometryStep& step, const PoseErrors& errors);
  // Another sensor alone moved odom to this pose: its covariance adds to the drift. Body axes, units of odom.
  void carry(const SE3& T_odom_body, std::int64_t utime, const Matrix6d& covariance);

  [[nodiscard]] const OdometryErrors& errors() const { return errors_; }

 private:
  void begin_drift(const OdometryStep& step);
  void grow(const OdometryStep& step, const Matrix6d& exchanged);
  void add_drift(const Matrix6d& growth, std::int64_t utime);
  [[nodiscard]] double scale_sigma(const OdometryStep& step, double holding_distance_m) const;

  double pair_sigma_per_m_ = std::numeric_limits<double>::infinity();
  OdometryErrors errors_;
  bool begun_ = false;
  Matrix6d waiting_ = Matrix6d::Zero();  // of the drift, axes of odom
  std::uint64_t view_sequence_ = 0;
  std::int64_t utime_ = 0;
};

}  // namespace farpoint::slam
