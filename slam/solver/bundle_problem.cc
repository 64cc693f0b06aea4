// SPDX-License-Identifier: Apache-2.0
#include "slam/solver/bundle_problem.h"

#include <cmath>
#include <limits>

namespace farpoint::slam {

namespace {

BundleFrames::Body body_of(const BundleProblem& problem, int pose) {
  const SE3& T = problem.poses[static_cast<std::size_t>(pose)].T_world_body;
  return {T.rotation(), T.t};
}

BundleFrames::View view_of(const BundleFrames::Body& body, const RigCamera& camera) {
  BundleFrames::View view;
  const Eigen::Matrix3d R_camera_body = camera.T_body_camera.rotation().transpose();
  view.R_camera_world = R_camera_body * body.R_world_body.transpose();
  view.t_camera_world = -(view.R_camera_world * body.t_world_body) - R_camera_body * camera.T_body_camera.t;
  view.camera = &camera.camera;
  return view;
}

BundleFrames::WorldPoint point_of(const BundleFrames::Body& host, const BundleProblem::Point& point) {
  BundleFrames::WorldPoint w;
  w.inverse_depth = point.inverse_depth;
  w.d_xyz_d_inverse_depth = host.R_world_body * point.T_host_anchor.t + host.t_world_body;
  w.xyz =
      host.R_world_body * (point.T_host_anchor.q * point.bearing) + w.inverse_depth * w.d_xyz_d_inverse_depth;
  return w;
}

const RigCamera& camera_of(const BundleProblem& problem, const BundleProblem::Measurement& m) {
  return problem.rig->cameras[static_cast<std::size_t>(m.camera)];
}

bool linearise_at(const BundleFrames::Body& host, const BundleFrames::Body& target,
                  const BundleFrames::View& view, const BundleProblem::Point& point,
                  const BundleProblem::Measurement& m, BundleLinearisation* out) {
  const BundleFrames::WorldPoint world = point_of(host, point);
  WorldLinearisation lin;
  if (!linearise_world(world, view, m, &lin)) return false;
  out->residual = lin.residual;
  out->d_inverse_depth = lin.d_inverse_depth;
  // Both poses in one keyframe (an anchor re-hosted into its own observer): the motion cancels.
  if (point.host == m.pose) {
    out->d_host.setZero();
    out->d_target.setZero();
    return true;
  }
  // A body that moves by (dt, dphi) carries what hangs on it by rho R dt - R [g]x dphi, g the point in its
  // axes; the target's motion moves what it sees the other way.
  const auto carry = [&](const BundleFrames::Body& body) {
    const Matrix23d d_body = lin.d_xyz * body.R_world_body;
    const Eigen::Vector3d g =
        body.R_world_body.transpose() * (world.xyz - world.inverse_depth * body.t_world_body);
    Eigen::Matrix<double, 2, 6> J;
    J.leftCols<3>() = world.inverse_depth * d_body;
    J.rightCols<3>() = -d_body * skew(g);
    return J;
  };
  out->d_host = carry(host);
  out->d_target = -carry(target);
  return true;
}

}  // namespace

void BundleFrames::update(const BundleProblem& problem) {
  cameras_ = problem.rig->cameras.size();
  bodies_.clear();
  views_.clear();
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    bodies_.push_back(body_of(problem, static_cast<int>(i)));
    for (const RigCamera& camera : problem.rig->cameras) views_.push_back(view_of(bodies_.back(), camera));
  }
}

BundleFrames::WorldPoint BundleFrames::world_point(const BundleProblem::Point& point) const {
  return point_of(body(point.host), point);
}

bool residual_world(const BundleFrames::WorldPoint& point, const BundleFrames::View& view,
                    const BundleProblem::Measurement& m, Eigen::Vector2d* out) {
  const Eigen::Vector3d p_c = view.R_camera_world * point.xyz + point.inverse_depth * view.t_camera_world;
  Eigen::Vector2d pixel;
  if (!view.camera->project(p_c, &pixel)) return false;
  *out = (pixel - m.pixel) / m.sigma_px;
  return true;
}

bool linearise_world(const BundleFrames::WorldPoint& point, const BundleFrames::View& view,
                     const BundleProblem::Measurement& m, WorldLinearisation* out) {
  const Eigen::Vector3d p_c = view.R_camera_world * point.xyz + point.inverse_depth * view.t_camera_world;
  Eigen::Vector2d pixel;
  Matrix23d d_pixel;
  if (!view.camera->project(p_c, &pixel, &d_pixel)) return false;
  const double inverse_sigma = 1.0 / m.sigma_px;
  out->residual = (pixel - m.pixel) * inverse_sigma;
  d_pixel *= inverse_sigma;
  out->d_xyz.noalias() = d_pixel * view.R_camera_world;
  out->d_inverse_depth = out->d_xyz * point.d_xyz_d_inverse_depth + d_pixel * view.t_camera_world;
  return true;
}

bool residual(const BundleProblem& problem, const BundleProblem::Point& point,
              const BundleProblem::Measurement& m, Eigen::Vector2d* out) {
  return residual_world(point_of(body_of(problem, point.host), point),
                        view_of(body_of(problem, m.pose), camera_of(problem, m)), m, out);
}

bool linearise(const BundleProblem& problem, const BundleProblem::Point& point,
               const BundleProblem::Measurement& m, BundleLinearisation* out) {
  const BundleFrames::Body target = body_of(problem, m.pose);
  return linearise_at(body_of(problem, point.host), target, view_of(target, camera_of(problem, m)), point, m,
                      out);
}

bool linearise(const BundleFrames& frames, const BundleProblem::Point& point,
               const BundleProblem::Measurement& m, BundleLinearisation* out) {
  return linearise_at(frames.body(point.host), frames.body(m.pose), frames.view(m), point, m, out);
}

void evaluate_bundle(BundleProblem* problem) {
  BundleFrames frames;
  frames.update(*problem);
  for (BundleProblem::Point& point : problem->points) {
    const BundleFrames::WorldPoint world = frames.world_point(point);
    double information = 0.0;
    for (int i = 0; i < point.measurements; ++i) {
      const int index = point.first_measurement + i;
      auto& m = problem->measurements[static_cast<std::size_t>(index)];
      WorldLinearisation lin;
      if (!linearise_world(world, frames.view(m), m, &lin)) {
        m.chi2 = std::numeric_limits<double>::infinity();
        continue;
      }
      m.chi2 = lin.residual.squaredNorm();
      if (m.chi2 < kChi2TwoDof) information += point.weight * lin.d_inverse_depth.squaredNorm();
    }
    point.inverse_depth_sigma = information > 0.0 ? 1.0 / std::sqrt(information) : 1e6;
  }
}

}  // namespace farpoint::slam
