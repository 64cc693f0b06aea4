// SPDX-License-Identifier: Apache-2.0
// The state of the body that sensors beside a camera measure: pose, velocity, biases of the IMU.
//
// Perturbation of 15 entries, in this order: translation and rotation as in se3.h (body axes), velocity
// (world axes), gyroscope bias and accelerometer bias (IMU axes).
#pragma once

#include <cstdint>

#include "slam/geometry/se3.h"

namespace farpoint::slam {

using Vector15d = Eigen::Matrix<double, 15, 1>;

struct BodyState {
  SE3 T_world_body;
  Eigen::Vector3d velocity_world = Eigen::Vector3d::Zero();               // world units a second
  Eigen::Vector3d gyroscope_bias_rad_per_s = Eigen::Vector3d::Zero();     // measured minus true
  Eigen::Vector3d accelerometer_bias_m_per_s2 = Eigen::Vector3d::Zero();  // measured minus true

  // The first entry of each part in a perturbation.
  static constexpr int kTranslation = 0, kRotation = 3, kVelocity = 6, kGyroscopeBias = 9,
                       kAccelerometerBias = 12;

  // This state moved by a perturbation.
  [[nodiscard]] BodyState boxplus(const Vector15d& delta) const {
    return {T_world_body.boxplus(delta.head<6>()), velocity_world + delta.segment<3>(kVelocity),
            gyroscope_bias_rad_per_s + delta.segment<3>(kGyroscopeBias),
            accelerometer_bias_m_per_s2 + delta.segment<3>(kAccelerometerBias)};
  }
  // The perturbation with (*this).boxplus(perturbation) == other.
  [[nodiscard]] Vector15d boxminus_to(const BodyState& other) const {
    Vector15d delta;
    delta << T_world_body.boxminus_to(other.T_world_body), other.velocity_world - velocity_world,
        other.gyroscope_bias_rad_per_s - gyroscope_bias_rad_per_s,
        other.accelerometer_bias_m_per_s2 - accelerometer_bias_m_per_s2;
    return delta;
  }
};

}  // namespace farpoint::slam
