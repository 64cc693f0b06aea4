// SPDX-License-Identifier: Apache-2.0
// Derivatives of the angles that buses send.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>

namespace farpoint::daemon {

// Derivatives of roll, pitch and yaw (R = Rz(yaw) Ry(pitch) Rx(roll)) by a small rotation about the body's
// axes. Nothing near a pitch of a quarter turn, where they have none.
[[nodiscard]] inline std::optional<Eigen::Matrix3d> d_angles_d_rotation(const Eigen::Matrix3d& R) {
  const double sin_pitch = -R(2, 0), cos_pitch = std::hypot(R(2, 1), R(2, 2));
  constexpr double kLeastCosine = 0.02;  // within a degree of straight up or down
  if (cos_pitch < kLeastCosine) return std::nullopt;
  const double sin_roll = R(2, 1) / cos_pitch, cos_roll = R(2, 2) / cos_pitch;
  Eigen::Matrix3d J;
  J << 1, sin_roll * sin_pitch / cos_pitch, cos_roll * sin_pitch / cos_pitch,  //
      0, cos_roll, -sin_roll,                                                  //
      0, sin_roll / cos_pitch, cos_roll / cos_pitch;
  return J;
}

}  // namespace farpoint::daemon
