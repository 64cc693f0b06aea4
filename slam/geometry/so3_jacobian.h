// SPDX-License-Identifier: Apache-2.0
// Derivatives of the exponential map of SO(3), for residuals that hold a rotation's logarithm.
// Source: Sola, Deray, Atchuthan, "A micro Lie theory", equations 143 to 146.
#pragma once

#include <cmath>

#include "slam/geometry/se3.h"

namespace farpoint::slam {

// Jr^-1(phi): Log(Exp(phi) Exp(d)) = phi + Jr^-1(phi) d to first order. |phi| below 2 pi; rad.
[[nodiscard]] inline Eigen::Matrix3d so3_right_jacobian_inverse(const Eigen::Vector3d& phi_rad) {
  const double theta2 = phi_rad.squaredNorm();
  const double theta = std::sqrt(theta2);
  // 1/theta^2 - (1 + cos theta)/(2 theta sin theta), by its series where that is 0/0.
  const double k =
      theta < 1e-3 ? 1.0 / 12.0 + theta2 / 720.0 : (1.0 - 0.5 * theta / std::tan(0.5 * theta)) / theta2;
  const Eigen::Matrix3d x = skew(phi_rad);
  return Eigen::Matrix3d::Identity() + 0.5 * x + k * x * x;
}

// Jl^-1(phi): Log(Exp(d) Exp(phi)) = phi + Jl^-1(phi) d to first order.
[[nodiscard]] inline Eigen::Matrix3d so3_left_jacobian_inverse(const Eigen::Vector3d& phi_rad) {
  return so3_right_jacobian_inverse(-phi_rad);
}

}  // namespace farpoint::slam
