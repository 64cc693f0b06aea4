#include "slam/mapping/bundle_problem.h"

#include <cmath>
#include <limits>

namespace farpoint::slam {

namespace {

// A landmark in the axes of the target camera, homogeneous, with what the derivatives need.
struct Chain {
  Eigen::Matrix3d R_host, R_target, R_camera_body;
  Eigen::Vector3d g;           // homogeneous point in host-body axes
  Eigen::Vector3d p_body;      // in target-body axes
  Eigen::Vector3d p_camera;
};

Chain walk(const BundleProblem& problem, const BundleProblem::Point& point, const BundleProblem::Measurement& m) {
  const SE3& host = problem.poses[static_cast<std::size_t>(point.host)].T_world_body;
  const SE3& target = problem.poses[static_cast<std::size_t>(m.pose)].T_world_body;
  const SE3& T_bc = problem.rig->cameras[static_cast<std::size_t>(m.camera)].T_body_camera;
  Chain c;
  c.R_host = host.rotation();
  c.R_target = target.rotation();
  c.R_camera_body = T_bc.rotation().transpose();
  const double rho = point.inverse_depth;
  c.g = point.T_host_anchor.q * point.bearing + rho * point.T_host_anchor.t;
  c.p_body = c.R_target.transpose() * (c.R_host * c.g + rho * (host.t - target.t));
  c.p_camera = c.R_camera_body * (c.p_body - rho * T_bc.t);
  return c;
}

}  // namespace

bool residual(const BundleProblem& problem, const BundleProblem::Point& point, const BundleProblem::Measurement& m,
              Eigen::Vector2d* out) {
  const Chain c = walk(problem, point, m);
  Eigen::Vector2d pixel;
  if (!problem.rig->cameras[static_cast<std::size_t>(m.camera)].camera.project(c.p_camera, &pixel)) return false;
  *out = (pixel - m.pixel) / m.sigma_px;
  return true;
}

bool linearise(const BundleProblem& problem, const BundleProblem::Point& point, const BundleProblem::Measurement& m,
               BundleLinearisation* out) {
  const Chain c = walk(problem, point, m);
  const RigCamera& camera = problem.rig->cameras[static_cast<std::size_t>(m.camera)];
  Eigen::Vector2d pixel;
  Matrix23d d_pixel;
  if (!camera.camera.project(c.p_camera, &pixel, &d_pixel)) return false;
  const double inverse_sigma = 1.0 / m.sigma_px;
  out->residual = (pixel - m.pixel) * inverse_sigma;
  const Matrix23d d_body = inverse_sigma * d_pixel * c.R_camera_body;    // by the point in target-body axes
  const double rho = point.inverse_depth;
  // Both poses in one keyframe (an anchor re-hosted into its own observer): the motion cancels.
  if (point.host == m.pose) {
    out->d_host.setZero();
    out->d_target.setZero();
  } else {
    const Matrix23d d_host_axes = d_body * c.R_target.transpose() * c.R_host;
    out->d_host.leftCols<3>() = rho * d_host_axes;
    out->d_host.rightCols<3>() = -d_host_axes * skew(c.g);
    out->d_target.leftCols<3>() = -rho * d_body;
    out->d_target.rightCols<3>() = d_body * skew(c.p_body);
  }
  const SE3& host = problem.poses[static_cast<std::size_t>(point.host)].T_world_body;
  const SE3& target = problem.poses[static_cast<std::size_t>(m.pose)].T_world_body;
  out->d_inverse_depth =
      d_body * (c.R_target.transpose() * (c.R_host * point.T_host_anchor.t + host.t - target.t) -
                camera.T_body_camera.t);
  return true;
}

void evaluate_bundle(BundleProblem* problem) {
  for (BundleProblem::Point& point : problem->points) {
    double information = 0.0;
    for (int i = 0; i < point.measurements; ++i) {
      auto& m = problem->measurements[static_cast<std::size_t>(point.first_measurement + i)];
      BundleLinearisation lin;
      if (!linearise(*problem, point, m, &lin)) {
        m.chi2 = std::numeric_limits<double>::infinity();
        continue;
      }
      m.chi2 = lin.residual.squaredNorm();
      if (m.chi2 < kChi2TwoDof) information += lin.d_inverse_depth.squaredNorm();
    }
    point.inverse_depth_sigma = information > 0.0 ? 1.0 / std::sqrt(information) : 1e6;
  }
}

}  // namespace farpoint::slam
