// SPDX-License-Identifier: Apache-2.0
#include "slam/geometry/se3.h"

#include <cmath>

namespace farpoint::slam {

Eigen::Quaterniond so3_exp(const Eigen::Vector3d& phi_rad) {
  const double theta2 = phi_rad.squaredNorm();
  const double theta = std::sqrt(theta2);
  // sin(theta/2)/theta; the series keeps full precision where the quotient would be 0/0.
  const double k = theta < 1e-4 ? 0.5 - theta2 / 48.0 : std::sin(0.5 * theta) / theta;
  const double w = theta < 1e-4 ? 1.0 - theta2 / 8.0 : std::cos(0.5 * theta);
  return Eigen::Quaterniond(w, k * phi_rad.x(), k * phi_rad.y(), k * phi_rad.z()).normalized();
}

Eigen::Vector3d so3_log(const Eigen::Quaterniond& q) {
  // q and -q are the same rotation; take the one with w >= 0 so that the angle is at most pi.
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  const Eigen::Vector3d v = sign * q.vec();
  const double w = sign * q.w();
  const double n = v.norm();
  if (n < 1e-10) return 2.0 / w * v;
  return 2.0 * std::atan2(n, w) / n * v;
}

}  // namespace farpoint::slam
