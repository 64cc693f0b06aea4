// SPDX-License-Identifier: Apache-2.0
// How far a pose of `odom` may be off.
#pragma once

#include <limits>

#include "slam/geometry/covariance.h"

namespace farpoint::slam {

// NaN where unknown. Order (dt, dphi) of se3.h, units of odom. A motion from a to b has the covariance
// Ad(T_b)^-1 (drift_b - drift_a) Ad(T_b)^-T + noise_b + Ad(T_b_a) noise_a Ad(T_b_a)^T + scale_sigma^2 t t^T
// in b's axes, t being its translation in them.
struct OdometryErrors {
  Matrix6d noise = unknown_covariance();  // of the pose; does not accumulate. Body axes
  Matrix6d drift = unknown_covariance();  // since the reset, on the first pose's noise. Axes of odom
  Matrix6d drift_of_second = unknown_covariance();  // its growth in the last second, about. Axes of odom
  double scale_sigma = std::numeric_limits<double>::quiet_NaN();  // relative; infinite: no scale

  // Of the pose, body axes: noise and drift since the reset, without the scale's part.
  [[nodiscard]] Matrix6d without_scale(const SE3& T_odom_body) const {
    return carried(T_odom_body.inverse(), drift) + noise;
  }
  // The same with the scale's part, where there is a scale.
  [[nodiscard]] Matrix6d since_reset(const SE3& T_odom_body) const;
  // Noise and a second's drift, body axes: for a filter that takes each pose as one measurement.
  [[nodiscard]] Matrix6d of_measurement(const SE3& T_odom_body) const {
    return carried(T_odom_body.inverse(), drift_of_second) + noise;
  }
};

}  // namespace farpoint::slam
