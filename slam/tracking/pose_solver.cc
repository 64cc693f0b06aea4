#include "slam/tracking/pose_solver.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace farpoint::slam {

namespace {

constexpr double kChi2 = 5.991;      // 95 %, two degrees of freedom
constexpr double kHuber = 2.4477;    // its root
constexpr int kIterations = 8;

struct Whitened {
  Eigen::Vector2d r;
  Eigen::Matrix<double, 2, 6> J;
};

// Residual and derivative in units of the residual's own covariance.
bool whiten(const Rig& rig, const SE3& T, const PoseMeasurement& m, Whitened* out) {
  Eigen::Vector2d r, d_rho;
  Eigen::Matrix<double, 2, 6> J;
  if (!pose_residual(rig, T, m, &r, &J, &d_rho)) return false;
  const double variance = m.sigma_px * m.sigma_px;
  const Eigen::Vector2d along = d_rho * m.inverse_depth_sigma;
  // (v I + a a')^-1/2 = (I - k a a') / s with k chosen so that it holds along a.
  const double a2 = along.squaredNorm();
  const double inverse_sigma = 1.0 / m.sigma_px;
  const double k = a2 > 1e-12 ? (1.0 - m.sigma_px / std::sqrt(variance + a2)) / a2 : 0.0;
  const Eigen::Matrix2d W = inverse_sigma * (Eigen::Matrix2d::Identity() - k * along * along.transpose());
  out->r = W * r;
  out->J = W * J;
  return true;
}

double huber_cost(double squared) {
  const double r = std::sqrt(squared);
  return r <= kHuber ? 0.5 * squared : kHuber * (r - 0.5 * kHuber);
}

struct Normal {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  double cost = 0;
};

Normal accumulate(const Rig& rig, const SE3& T, std::span<const PoseMeasurement> measurements, bool robust) {
  Normal n;
  for (const PoseMeasurement& m : measurements) {
    Whitened w;
    if (!m.inlier || !whiten(rig, T, m, &w)) continue;
    const double squared = w.r.squaredNorm();
    const double weight = robust && squared > kChi2 ? kHuber / std::sqrt(squared) : 1.0;
    n.cost += robust ? huber_cost(squared) : 0.5 * squared;
    n.H.noalias() += weight * w.J.transpose() * w.J;
    n.g.noalias() += weight * w.J.transpose() * w.r;
  }
  return n;
}

SE3 descend(const Rig& rig, SE3 T, std::span<const PoseMeasurement> measurements, bool robust) {
  double lambda = 1e-4;
  Normal n = accumulate(rig, T, measurements, robust);
  for (int i = 0; i < kIterations; ++i) {
    Matrix6d damped = n.H;
    damped.diagonal() *= 1.0 + lambda;
    damped.diagonal().array() += 1e-9;
    const Vector6d step = damped.ldlt().solve(-n.g);
    if (!step.allFinite()) break;
    const SE3 candidate = T.boxplus(step);
    const Normal next = accumulate(rig, candidate, measurements, robust);
    if (next.cost < n.cost) {
      const bool done = n.cost - next.cost < 1e-5 * n.cost;
      T = candidate;
      n = next;
      lambda = std::max(0.1 * lambda, 1e-9);
      if (done) break;
    } else {
      lambda *= 10.0;
      if (lambda > 1e6) break;
    }
  }
  return T;
}

int classify(const Rig& rig, const SE3& T, std::span<PoseMeasurement> measurements, double* rms) {
  int inliers = 0;
  double sum = 0;
  for (PoseMeasurement& m : measurements) {
    Whitened w;
    m.inlier = whiten(rig, T, m, &w) && w.r.squaredNorm() < kChi2;
    if (!m.inlier) continue;
    ++inliers;
    sum += w.r.squaredNorm();
  }
  *rms = inliers > 0 ? std::sqrt(sum / (2.0 * inliers)) : 0.0;
  return inliers;
}

}  // namespace

bool pose_residual(const Rig& rig, const SE3& T_world_body, const PoseMeasurement& m, Eigen::Vector2d* residual_px,
                   Eigen::Matrix<double, 2, 6>* d_pose, Eigen::Vector2d* d_inverse_depth) {
  const RigCamera& camera = rig.cameras[static_cast<std::size_t>(m.camera)];
  const Eigen::Matrix3d R_body_world = T_world_body.rotation().transpose();
  const Eigen::Matrix3d R_camera_body = camera.T_body_camera.rotation().transpose();
  const double rho = m.point_w[3];
  const Eigen::Vector3d p_b = R_body_world * (m.point_w.head<3>() - rho * T_world_body.t);
  const Eigen::Vector3d p_c = R_camera_body * (p_b - rho * camera.T_body_camera.t);
  Eigen::Vector2d pixel;
  Matrix23d d_pixel;
  if (!camera.camera.project(p_c, &pixel, &d_pixel)) return false;
  *residual_px = pixel - m.pixel;
  const Matrix23d d_body = d_pixel * R_camera_body;
  d_pose->leftCols<3>() = -rho * d_body;
  d_pose->rightCols<3>() = d_body * skew(p_b);
  *d_inverse_depth = d_body * (R_body_world * (m.anchor_w - T_world_body.t) - camera.T_body_camera.t);
  return true;
}

PoseSolution solve_pose(const Rig& rig, const SE3& start, std::span<PoseMeasurement> measurements, int rounds) {
  PoseSolution s;
  s.T_world_body = start;
  for (int round = 0; round < rounds; ++round) {
    // The last rounds work on inliers alone, without the loss: what is left is Gaussian.
    const bool robust = round < std::max(1, rounds / 2);
    s.T_world_body = descend(rig, s.T_world_body, measurements, robust);
    s.inliers = classify(rig, s.T_world_body, measurements, &s.rms);
    if (s.inliers < 6) return s;
  }
  const Normal n = accumulate(rig, s.T_world_body, measurements, false);
  const Eigen::LDLT<Matrix6d> factor(n.H);
  s.covariance = factor.solve(Matrix6d::Identity());
  s.ok = s.T_world_body.is_finite() && s.covariance.allFinite() && (s.covariance.diagonal().array() > 0.0).all();
  return s;
}

}  // namespace farpoint::slam
