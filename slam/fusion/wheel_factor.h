// SPDX-License-Identifier: Apache-2.0
// The wheels' motion between two body poses, as a factor of a bundle problem.
//
// Residual, 3x1, whitened by the motion's covariance C = L L':
//     r = L^-1 ( [s R_a' (t_b - t_a) + (R_a' R_b - I) p]_xy - k d,  Log(R_a' R_b)_z - yaw )
// with d and yaw the wheels' motion, p where on the body they measure it, s the scale of the map (metres a
// unit) and k the wheel factor (metres a metre of the wheels). Height, roll and pitch stay free: the road is
// not a plane.
#pragma once

#include <array>

#include "slam/fusion/wheel_track.h"
#include "slam/solver/factor.h"

namespace farpoint::slam {

struct WheelFactorStates {
  static constexpr int kNone = -1;

  int from_pose = 0, to_pose = 0;
  // Globals of kind kPositive; kNone takes 1. A problem that leaves both free has no metric information.
  int scale_m_per_unit = kNone;
  int wheel_factor = kNone;
};

class WheelFactor final : public StateFactor {
 public:
  // |r| from which a motion counts as slipped and weighs less: the 99 % quantile's root, three of freedom.
  static constexpr double kSlipped = 3.368;

  // `point_m`: where on the body the wheels measure, body axes.
  // Precondition: the motion's covariance is positive definite.
  WheelFactor(const WheelFactorStates& states, const WheelMotion& motion,
              const Eigen::Vector3d& point_m = Eigen::Vector3d::Zero());

  [[nodiscard]] std::span<const StateBlock> blocks() const override {
    return std::span(blocks_).first(block_count_);
  }
  [[nodiscard]] int residuals() const override { return 3; }
  void evaluate(const StateWindow& states, FactorResidual* residual, FactorJacobian* jacobian) const override;
  [[nodiscard]] double huber_delta() const override { return kSlipped; }

 private:
  [[nodiscard]] static double value_of(const StateWindow& states, int global) {
    return global == WheelFactorStates::kNone ? 1.0 : states.global(global).value.x();
  }

  WheelFactorStates states_;
  Eigen::Vector3d point_m_;
  Eigen::Vector2d displacement_m_;
  double yaw_rad_;
  Eigen::Matrix3d whitener_;  // L^-1
  std::array<StateBlock, 4> blocks_;
  std::size_t block_count_ = 2;
};

}  // namespace farpoint::slam
