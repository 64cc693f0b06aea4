// SPDX-License-Identifier: Apache-2.0
// Covariances of poses: order (translation, rotation), perturbation as in se3.h, carried from one frame to
// another.
#pragma once

#include <limits>

#include "slam/geometry/se3.h"

namespace farpoint::slam {

// Not known: NaN throughout.
[[nodiscard]] inline Matrix6d unknown_covariance() {
  return Matrix6d::Constant(std::numeric_limits<double>::quiet_NaN());
}

// Ad(T_A_B): carries a small motion of B's axes into the same motion of A's.
[[nodiscard]] inline Matrix6d adjoint(const SE3& T_A_B) {
  const Eigen::Matrix3d R = T_A_B.rotation();
  Matrix6d Ad = Matrix6d::Zero();
  Ad.topLeftCorner<3, 3>() = Ad.bottomRightCorner<3, 3>() = R;
  Ad.topRightCorner<3, 3>() = skew(T_A_B.t) * R;
  return Ad;
}

// The covariance in A's axes of what has `covariance` in B's.
[[nodiscard]] inline Matrix6d carried(const SE3& T_A_B, const Matrix6d& covariance) {
  const Matrix6d Ad = adjoint(T_A_B);
  const Matrix6d c = Ad * covariance * Ad.transpose();
  return 0.5 * (c + c.transpose());
}

// The same in a unit of length of which `scale` make one of the old.
[[nodiscard]] inline Matrix6d in_unit(Matrix6d covariance, double scale) {
  covariance.topRows<3>() *= scale;
  covariance.leftCols<3>() *= scale;
  return covariance;
}

}  // namespace farpoint::slam
