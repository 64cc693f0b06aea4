// SPDX-License-Identifier: Apache-2.0
// How far `odom` may be off: noise of a pose, drift since the reset, sigma of the unit.
#pragma once

#include <cstdint>
#include <limits>

#include "slam/geometry/covariance.h"
#include "slam/geometry/rig.h"
#include "slam/tracking/pose_errors.h"

namespace farpoint::slam {

// NaN where unknown. Order (dt, dphi) of se3.h, units of odom. A motion from a to b has the covariance
// Ad(T_b)^-1 (drift_b - drift_a) Ad(T_b)^-T + noise_b + Ad(T_b_a) noise_a Ad(T_b_a)^T + scale_sigma^2 t t^T in
// b's axes, t being its translation in them.
struct OdometryErrors {
  Matrix6d noise = unknown_covariance();  // of the pose; does not accumulate. Body axes
  Matrix6d drift = unknown_covariance();  // since the reset, from the first pose's noise on. Axes of odom
  double scale_sigma = std::numeric_limits<double>::quiet_NaN();  // relative

  // Of the pose since the reset, body axes.
  [[nodiscard]] Matrix6d since_reset(const SE3& T_odom_body) const;
};

class Uncertainty {
 public:
  explicit Uncertainty(const Rig& rig);

  // A new map: nothing is known of its poses, and nothing has drifted.
  void begin_map();
  // A pose with these errors, tracked against the view of this number. `map_units`: in a unit of odom. While
  // frames hang on the same view, what they exchange of its landmarks waits: the drift rises with the next
  // view.
  void advance(const SE3& T_odom_body, const PoseErrors& errors, double map_units, std::uint64_t view_sequence,
               bool metric);

  [[nodiscard]] const OdometryErrors& errors() const { return errors_; }

 private:
  [[nodiscard]] double scale_sigma(double holding_distance_m) const;

  double pair_sigma_per_m_ = std::numeric_limits<double>::infinity();
  OdometryErrors errors_;
  bool begun_ = false;
  Matrix6d waiting_ = Matrix6d::Zero();  // of the drift, axes of odom
  std::uint64_t view_sequence_ = 0;
};

}  // namespace farpoint::slam
