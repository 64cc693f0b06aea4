// SPDX-License-Identifier: Apache-2.0
// Robust 6-DoF pose of the body from landmarks and a prior. Fixed size, no heap.
#pragma once

#include <span>

#include "slam/geometry/motion_model.h"
#include "slam/geometry/rig.h"
#include "slam/geometry/se3.h"

namespace farpoint::slam {

// One sighting of a landmark with known position.
struct PoseMeasurement {
  Eigen::Vector4d point_w = Eigen::Vector4d::Zero();   // homogeneous
  Eigen::Vector3d anchor_w = Eigen::Vector3d::Zero();  // d(point xyz) / d(rho)
  double inverse_depth_sigma = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double sigma_px = 1.0;
  int camera = 0;
  bool inlier = true;  // in: takes part in the first round; out: chi-square below the 95 % quantile
};

struct PoseSolution {
  SE3 T_world_body;
  Matrix6d covariance = Matrix6d::Zero();  // (dt, dphi) of se3.h
  int inliers = 0;
  double rms = 0;  // of the inliers' residuals, in sigmas
  bool ok = false;
};

// Levenberg-Marquardt with Huber weights from a start, in at most `rounds` rounds. Each round ends
// with a new choice of the measurements that take part: chi-square below the 99.9 % quantile. The rounds end
// early where that choice is the last one's.
//
// Covariance of a measurement's residual: sigma^2 I + J_rho J_rho' sigma_rho^2, so that an uncertain depth
// does not pull the pose along its epipolar line. The prior adds 0.5 r' information r with r of
// prior_residual; zero information adds nothing. Fewer than 6 inliers give ok = false, whatever the prior.
[[nodiscard]] PoseSolution solve_pose(const Rig& rig, const PosePrior& prior, const SE3& T_world_body_start,
                                      std::span<PoseMeasurement> measurements, int rounds = 4);
// The same from the prior's pose.
[[nodiscard]] inline PoseSolution solve_pose(const Rig& rig, const PosePrior& prior,
                                             std::span<PoseMeasurement> measurements, int rounds = 4) {
  return solve_pose(rig, prior, prior.T_world_body, measurements, rounds);
}
// The same from a start without a prior.
[[nodiscard]] inline PoseSolution solve_pose(const Rig& rig, const SE3& T_world_body_start,
                                             std::span<PoseMeasurement> measurements, int rounds = 4) {
  return solve_pose(rig, PosePrior{}, T_world_body_start, measurements, rounds);
}

// Residual of a pose against an expected one, T_prior.boxminus_to(T_world_body), and its derivative by the
// pose.
void prior_residual(const SE3& T_prior, const SE3& T_world_body, Vector6d* residual, Matrix6d* d_pose);

// Residual (2x1, px) and its derivative by the pose; for the solver and its tests.
[[nodiscard]] bool pose_residual(const Rig& rig, const SE3& T_world_body, const PoseMeasurement& m,
                                 Eigen::Vector2d* residual_px, Eigen::Matrix<double, 2, 6>* d_pose,
                                 Eigen::Vector2d* d_inverse_depth);

}  // namespace farpoint::slam
