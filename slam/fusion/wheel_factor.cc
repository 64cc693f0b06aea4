// SPDX-License-Identifier: Apache-2.0
#include "slam/fusion/wheel_factor.h"

#include <Eigen/Cholesky>

#include "slam/geometry/so3_jacobian.h"

namespace farpoint::slam {

WheelFactor::WheelFactor(const WheelFactorStates& states, const WheelMotion& motion,
                         const Eigen::Vector3d& point_m)
    : states_(states), point_m_(point_m), displacement_m_(motion.displacement_m), yaw_rad_(motion.yaw_rad) {
  const Eigen::LLT<Eigen::Matrix3d> factor(motion.covariance);
  whitener_ = factor.matrixL().solve(Eigen::Matrix3d::Identity());
  blocks_[0] = StateBlock::pose(states.from_pose);
  blocks_[1] = StateBlock::pose(states.to_pose);
  for (const int global : {states.scale_m_per_unit, states.wheel_factor})
    if (global != WheelFactorStates::kNone) blocks_[block_count_++] = StateBlock::global(global);
}

void WheelFactor::evaluate(const StateWindow& states, FactorResidual* residual,
                           FactorJacobian* jacobian) const {
  const SE3& T_world_a = states.T_world_body(states_.from_pose);
  const SE3& T_world_b = states.T_world_body(states_.to_pose);
  const double scale = value_of(states, states_.scale_m_per_unit);
  const double wheel_factor = value_of(states, states_.wheel_factor);
  const Eigen::Quaterniond q_a_b = T_world_a.q.conjugate() * T_world_b.q;
  const Eigen::Vector3d t_a_b = T_world_a.q.conjugate() * (T_world_b.t - T_world_a.t);
  const Eigen::Vector3d turn_rad = so3_log(q_a_b);

  Eigen::Vector3d r;
  const Eigen::Matrix3d R_a_b = q_a_b.toRotationMatrix();
  const Eigen::Vector3d turned_m = R_a_b * point_m_;
  r.head<2>() = (scale * t_a_b + turned_m - point_m_).head<2>() - wheel_factor * displacement_m_;
  r.z() = turn_rad.z() - yaw_rad_;
  *residual = whitener_ * r;
  if (jacobian == nullptr) return;

  jacobian->topLeftCorner<2, 3>() = -scale * Eigen::Matrix3d::Identity().topRows<2>();
  jacobian->block<2, 3>(0, 3) = skew(scale * t_a_b + turned_m).topRows<2>();
  jacobian->block<1, 3>(2, 3) = -so3_left_jacobian_inverse(turn_rad).bottomRows<1>();
  jacobian->block<2, 3>(0, 6) = scale * R_a_b.topRows<2>();
  jacobian->block<2, 3>(0, 9) = -(R_a_b * skew(point_m_)).topRows<2>();
  jacobian->block<1, 3>(2, 9) = so3_right_jacobian_inverse(turn_rad).bottomRows<1>();
  int column = 12;
  if (states_.scale_m_per_unit != WheelFactorStates::kNone)
    jacobian->block<2, 1>(0, column++) = scale * t_a_b.head<2>();
  if (states_.wheel_factor != WheelFactorStates::kNone)
    jacobian->block<2, 1>(0, column) = -wheel_factor * displacement_m_;
  *jacobian = (whitener_ * *jacobian).eval();
}

}  // namespace farpoint::slam
