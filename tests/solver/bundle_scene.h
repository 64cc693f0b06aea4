// SPDX-License-Identifier: Apache-2.0
// Random bundle problems with known truth, for the tests and the bench of the solvers.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>
#include <vector>

#include "slam/solver/bundle_problem.h"

namespace farpoint::slam {

struct SceneOptions {
  int poses = 20, fixed = 2;  // the first ones are fixed
  int points = 1500;
  int observations = 6;  // at most, besides the host
  int cameras = 1;
  double infinite_share = 0.05;  // points with rho = 0
  double far_m = 3000.0;         // the others lie between 3 m and this
  double rehosted_share =
      0.1;                // anchor somewhere near the host, not its camera; the host's sighting is measured
  double noise_px = 0.5;  // of every measurement; its sigma_px
  double least_weight = 1.0;   // of a point; the others lie between this and 1
  double outlier_share = 0.0;  // measurements that are 5 to 40 px off
  double start_m = 0.05, start_rad = 0.005, start_log_depth = 0.1;  // 1 sigma of the start's error
  std::uint64_t seed = 1;
};

// A body that drives a bend, 1 m a pose, and looks ahead; points from 3 m to 3 km and at infinity.
class BundleScene {
 public:
  explicit BundleScene(const SceneOptions& options) : options_(options), random_(options.seed) {
    add_cameras();
    add_poses();
    for (int i = 0; i < options_.points; ++i) add_point();
    start = truth;
    disturb();
  }
  BundleScene(const BundleScene&) = delete;  // the problems point at the rig

  Rig rig;
  BundleProblem truth, start;

  double normal() { return std::normal_distribution<double>()(random_); }
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Eigen::Vector3d normal3() { return {normal(), normal(), normal()}; }
  Vector6d normal6(double translation, double rotation) {
    Vector6d d;
    d << translation * normal3(), rotation * normal3();
    return d;
  }

 private:
  void add_cameras() {
    Camera::Parameters p;
    p.width_px = 752, p.height_px = 480;
    p.fx_px = 458, p.fy_px = 457, p.cx_px = 367, p.cy_px = 248;
    p.distortion = {-0.28, 0.07, 0.0002, 0.00002, 0.0};
    rig.cameras.push_back({"front", Camera(p), {q_body_forward_camera(), {0.3, 0.1, 0.2}}});
    for (int i = 1; i < options_.cameras; ++i) {
      p.model = CameraModel::kKannalaBrandt;
      p.fx_px = 300, p.fy_px = 301;
      p.distortion = {0.01, -0.005, 0.002, -0.0004, 0.0};
      const SE3 side{so3_exp({0.02, -0.03, 0.5}), {0.1, -0.4, 0.05}};
      rig.cameras.push_back({"side", Camera(p), side * rig.cameras[0].T_body_camera});
    }
    truth.rig = &rig;
  }

  void add_poses() {
    SE3 T;
    const SE3 step{so3_exp({0.002, -0.003, 0.02}), {1.0, 0.02, 0.01}};
    for (int i = 0; i < options_.poses; ++i) {
      truth.poses.push_back({T.boxplus(normal6(0.05, 0.01)), i < options_.fixed});
      T = T * step;
    }
  }

  // Draws until a point is seen by at least two others.
  void add_point() {
    for (;;) {
      BundleProblem::Point point;
      point.host = static_cast<int>(uniform(0.0, options_.poses - 1e-9));
      const int camera = static_cast<int>(uniform(0.0, options_.cameras - 1e-9));
      const bool rehosted = uniform(0.0, 1.0) < options_.rehosted_share;
      const SE3& T_body_camera = rig.cameras[static_cast<std::size_t>(camera)].T_body_camera;
      point.T_host_anchor = rehosted ? T_body_camera.boxplus(normal6(1.0, 0.05)) : T_body_camera;
      if (!rig.cameras[static_cast<std::size_t>(camera)].camera.unproject(
              {uniform(20, 730), uniform(20, 460)}, &point.bearing))
        continue;
      const bool infinite = uniform(0.0, 1.0) < options_.infinite_share;
      point.inverse_depth = infinite ? 0.0 : 1.0 / (3.0 * std::pow(options_.far_m / 3.0, uniform(0.0, 1.0)));
      if (options_.least_weight < 1.0) point.weight = uniform(options_.least_weight, 1.0);
      if (add_measurements(&point, rehosted)) return;
    }
  }

  bool add_measurements(BundleProblem::Point* point, bool rehosted) {
    std::vector<int> order(static_cast<std::size_t>(options_.poses));
    std::iota(order.begin(), order.end(), 0);
    std::shuffle(order.begin(), order.end(), random_);
    // The host comes first where its sighting is a measurement.
    std::stable_partition(order.begin(), order.end(), [&](int i) { return i == point->host; });
    const std::size_t first = truth.measurements.size();
    for (const int pose : order) {
      if (pose == point->host && !rehosted) continue;
      if (static_cast<int>(truth.measurements.size() - first) >= options_.observations) break;
      BundleProblem::Measurement m;
      m.pose = pose;
      m.camera = static_cast<int>(uniform(0.0, options_.cameras - 1e-9));
      m.sigma_px = 1.0;
      Eigen::Vector2d pixel;
      if (!residual(truth, *point, m, &pixel)) continue;
      if (!rig.cameras[static_cast<std::size_t>(m.camera)].camera.in_image(pixel)) continue;
      m.pixel = pixel;
      m.sigma_px = options_.noise_px > 0.0 ? options_.noise_px : 1.0;
      truth.measurements.push_back(m);
    }
    point->first_measurement = static_cast<int>(first);
    point->measurements = static_cast<int>(truth.measurements.size() - first);
    if (point->measurements < 2) {
      truth.measurements.resize(first);
      return false;
    }
    truth.points.push_back(*point);
    return true;
  }

  [[nodiscard]] bool projects(const BundleProblem::Point& point) const {
    Eigen::Vector2d r;
    for (int i = 0; i < point.measurements; ++i)
      if (!residual(start, point,
                    start.measurements[static_cast<std::size_t>(point.first_measurement) +
                                       static_cast<std::size_t>(i)],
                    &r))
        return false;
    return true;
  }

  void disturb() {
    for (auto& pose : start.poses)
      if (!pose.fixed)
        pose.T_world_body = pose.T_world_body.boxplus(normal6(options_.start_m, options_.start_rad));
    for (std::size_t k = 0; k < start.points.size(); ++k) {
      double& rho = start.points[k].inverse_depth;
      rho =
          rho * std::exp(options_.start_log_depth * normal()) + (rho > 0.0 ? 0.0 : 1e-3 * std::abs(normal()));
      // A start from which some sighting does not project is another matter, with a test of its own.
      if (!projects(start.points[k])) rho = truth.points[k].inverse_depth;
    }
    for (auto& m : start.measurements) {
      m.pixel += options_.noise_px * Eigen::Vector2d(normal(), normal());
      if (uniform(0.0, 1.0) >= options_.outlier_share) continue;
      const double direction = uniform(-3.141592653589793, 3.141592653589793);
      m.pixel += uniform(5.0, 40.0) * Eigen::Vector2d(std::cos(direction), std::sin(direction));
    }
  }

  SceneOptions options_;
  std::mt19937_64 random_;
};

}  // namespace farpoint::slam
