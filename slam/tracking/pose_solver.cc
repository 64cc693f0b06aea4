// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/pose_solver.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "slam/geometry/robust.h"
#include "slam/geometry/so3_jacobian.h"

namespace farpoint::slam {

namespace {

// What takes part in the next round. Cutting at the inliers' 95 % instead would make the pose's variance 19 %
// larger than the normal equations say. Of 2D normal residuals it keeps 95 % of the information and 80 % of
// the pull that holds the pose; variance 1 / 0.80 against 1 / 0.95.
constexpr double kChi2Used = kChi2TwoDof999;
// Cost of a measurement that does not project, as of one of 1000 sigmas: a pose that sees nothing never wins.
constexpr double kLostCost = kHuberDelta * (1000.0 - 0.5 * kHuberDelta);
constexpr int kIterations = 8;

// What the measurements of one camera share at one pose.
struct View {
  const Camera* camera = nullptr;
  Eigen::Matrix3d R_body_world, R_camera_body, R_camera_world;
  Eigen::Vector3d t_world_body, t_camera_world;

  View() = default;
  View(const RigCamera& c, const SE3& T_world_body)
      : camera(&c.camera),
        R_body_world(T_world_body.rotation().transpose()),
        R_camera_body(c.T_body_camera.rotation().transpose()),
        R_camera_world(R_camera_body * R_body_world),
        t_world_body(T_world_body.t),
        t_camera_world(-(R_camera_world * t_world_body) - R_camera_body * c.T_body_camera.t) {}
};

// The view of the camera asked for last: measurements come camera by camera, mostly from one.
class Views {
 public:
  Views(const Rig& rig, const SE3& T_world_body) : rig_(rig), T_world_body_(T_world_body) {}
  const View& of(int camera) {
    if (camera != last_) view_ = View(rig_.cameras[static_cast<std::size_t>(camera)], T_world_body_);
    last_ = camera;
    return view_;
  }

 private:
  const Rig& rig_;
  const SE3& T_world_body_;
  View view_;
  int last_ = -1;
};

bool residual_at(const View& view, const PoseMeasurement& m, Eigen::Vector2d* residual_px,
                 Eigen::Matrix<double, 2, 6>* d_pose, Eigen::Vector2d* d_inverse_depth) {
  const double rho = m.point_w[3];
  const Eigen::Vector3d p_c = view.R_camera_world * m.point_w.head<3>() + rho * view.t_camera_world;
  Eigen::Vector2d pixel;
  Matrix23d d_pixel;
  if (!view.camera->project(p_c, &pixel, &d_pixel)) return false;
  *residual_px = pixel - m.pixel;
  const Eigen::Vector3d p_b = view.R_body_world * (m.point_w.head<3>() - rho * view.t_world_body);
  const Matrix23d d_body = d_pixel * view.R_camera_body;
  d_pose->leftCols<3>() = -rho * d_body;
  d_pose->rightCols<3>() = d_body * skew(p_b);
  *d_inverse_depth = d_pixel * (view.R_camera_world * m.anchor_w + view.t_camera_world);
  return true;
}

struct Whitened {
  Eigen::Vector2d r;
  Eigen::Matrix<double, 2, 6> J;
};

// Residual and derivative in units of the residual's own covariance.
bool whiten(const View& view, const PoseMeasurement& m, Whitened* out) {
  Eigen::Vector2d r, d_rho;
  Eigen::Matrix<double, 2, 6> J;
  if (!residual_at(view, m, &r, &J, &d_rho)) return false;
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

struct Normal {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  double cost = 0;
};

// What all steps of one solve share.
struct Problem {
  const Rig& rig;
  const PosePrior& prior;
  bool pulls;  // the prior has information
};

void add_prior(const PosePrior& prior, const SE3& T, Normal* n) {
  Vector6d r;
  Matrix6d J;
  prior_residual(prior.T_world_body, T, &r, &J);
  const Vector6d weighted = prior.information * r;
  n->cost += 0.5 * r.dot(weighted);
  n->H.noalias() += J.transpose() * prior.information * J;
  n->g.noalias() += J.transpose() * weighted;
}

// Huber's loss over the measurements in use, and the prior's.
Normal accumulate(const Problem& problem, const SE3& T, std::span<const PoseMeasurement> measurements) {
  Normal n;
  const Rig& rig = problem.rig;
  Views views(rig, T);
  for (const PoseMeasurement& m : measurements) {
    if (!m.inlier) continue;
    Whitened w;
    if (!whiten(views.of(m.camera), m, &w)) {
      n.cost += kLostCost;
      continue;
    }
    const double squared = w.r.squaredNorm(), weight = huber_weight(squared);
    n.cost += huber_cost(squared);
    n.H.noalias() += weight * w.J.transpose() * w.J;
    n.g.noalias() += weight * w.J.transpose() * w.r;
  }
  if (problem.pulls) add_prior(problem.prior, T, &n);
  return n;
}

SE3 descend(const Problem& problem, SE3 T, std::span<const PoseMeasurement> measurements) {
  double lambda = 1e-4;
  Normal n = accumulate(problem, T, measurements);
  for (int i = 0; i < kIterations; ++i) {
    Matrix6d damped = n.H;
    damped.diagonal() *= 1.0 + lambda;
    damped.diagonal().array() += 1e-9;
    const Vector6d step = damped.ldlt().solve(-n.g);
    // The step predicts its gain. Where that is nothing, the trial would only cost time.
    if (!step.allFinite() || -n.g.dot(step) < 2e-6 * n.cost) break;
    const SE3 candidate = T.boxplus(step);
    const Normal next = accumulate(problem, candidate, measurements);
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

struct Sorted {
  int inliers = 0;
  double rms = 0;        // theirs, in sigmas
  bool changed = false;  // some measurement changed sides
};

// Marks what lies below the gate.
Sorted classify(const Rig& rig, const SE3& T, double gate, std::span<PoseMeasurement> measurements) {
  Sorted out;
  double sum = 0;
  Views views(rig, T);
  for (PoseMeasurement& m : measurements) {
    Whitened w;
    const bool inlier = whiten(views.of(m.camera), m, &w) && w.r.squaredNorm() < gate;
    out.changed = out.changed || inlier != m.inlier;
    m.inlier = inlier;
    if (!inlier) continue;
    ++out.inliers;
    sum += w.r.squaredNorm();
  }
  out.rms = out.inliers > 0 ? std::sqrt(sum / (2.0 * out.inliers)) : 0.0;
  return out;
}

}  // namespace

bool pose_residual(const Rig& rig, const SE3& T_world_body, const PoseMeasurement& m,
                   Eigen::Vector2d* residual_px, Eigen::Matrix<double, 2, 6>* d_pose,
                   Eigen::Vector2d* d_inverse_depth) {
  return residual_at(View(rig.cameras[static_cast<std::size_t>(m.camera)], T_world_body), m, residual_px,
                     d_pose, d_inverse_depth);
}

void prior_residual(const SE3& T_prior, const SE3& T_world_body, Vector6d* residual, Matrix6d* d_pose) {
  *residual = T_prior.boxminus_to(T_world_body);
  d_pose->setZero();
  d_pose->topLeftCorner<3, 3>() = (T_prior.q.conjugate() * T_world_body.q).toRotationMatrix();
  d_pose->bottomRightCorner<3, 3>() = so3_right_jacobian_inverse(residual->tail<3>());
}

PoseSolution solve_pose(const Rig& rig, const PosePrior& prior, const SE3& T_world_body_start,
                        std::span<PoseMeasurement> measurements, int rounds) {
  constexpr int kFewest = 6;
  const Problem problem{rig, prior, (prior.information.array() != 0.0).any()};
  PoseSolution s;
  s.T_world_body = T_world_body_start;
  for (int round = 0; round < rounds; ++round) {
    s.T_world_body = descend(problem, s.T_world_body, measurements);
    const Sorted used = classify(rig, s.T_world_body, kChi2Used, measurements);
    s.inliers = used.inliers;
    s.rms = used.rms;
    if (used.inliers < kFewest) return s;
    if (!used.changed) break;
  }
  const Normal n = accumulate(problem, s.T_world_body, measurements);
  const Sorted last = classify(rig, s.T_world_body, kChi2TwoDof, measurements);
  s.inliers = last.inliers;
  s.rms = last.rms;
  if (last.inliers < kFewest) return s;
  const Eigen::LDLT<Matrix6d> factor(n.H);
  s.covariance = factor.solve(Matrix6d::Identity());
  s.ok =
      s.T_world_body.is_finite() && s.covariance.allFinite() && (s.covariance.diagonal().array() > 0.0).all();
  return s;
}

}  // namespace farpoint::slam
