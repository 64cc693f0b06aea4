// Robust 6-DoF pose of the body from landmarks: fixed size, no heap.
#pragma once

#include <span>

#include "slam/config.h"
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
  bool inlier = true;  // in: starts as; out: chi-square below the 95 % quantile
};

struct PoseSolution {
  SE3 T_world_body;
  Matrix6d covariance = Matrix6d::Zero();  // (dt, dphi) of se3.h
  int inliers = 0;
  double rms = 0;  // of the inliers' residuals, in sigmas
  bool ok = false;
};

// Levenberg-Marquardt with Huber weights, in at most so many rounds; after each round it is decided anew
// which measurements take part (chi-square below the 99.9 % quantile), and when none changes sides it is
// done. The covariance of a residual is sigma^2 I + J_rho J_rho' sigma_rho^2: what the landmark's depth
// leaves open along its epipolar line does not pull the pose.
[[nodiscard]] PoseSolution solve_pose(const Rig& rig, const SE3& T_world_body_start,
                                      std::span<PoseMeasurement> measurements, int rounds = 4);

// Residual (2x1, px) and its derivative by the pose; for the solver and its tests.
[[nodiscard]] bool pose_residual(const Rig& rig, const SE3& T_world_body, const PoseMeasurement& m,
                                 Eigen::Vector2d* residual_px, Eigen::Matrix<double, 2, 6>* d_pose,
                                 Eigen::Vector2d* d_inverse_depth);

}  // namespace farpoint::slam
