// SPDX-License-Identifier: Apache-2.0
// Bundle adjustment over body poses and host-anchored inverse depths, as plain arrays that all solvers share.
//
// Residual of one measurement, in units of its sigma:
//     r = (project_c(T_camera_body T_body_world T_world_host T_host_anchor (f, rho)) - z) / sigma,     2x1
// with homogeneous points (f, rho), so that a landmark at infinity (rho = 0) is as well conditioned as a near
// one. Cost: sum over the points of their weight times the Huber losses of |r|, delta = kHuberDelta, and the
// costs of the factors.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "slam/geometry/rig.h"
#include "slam/geometry/robust.h"
#include "slam/geometry/se3.h"
#include "slam/solver/factor.h"

namespace farpoint::slam {

struct BundleProblem {
  using Pose = PoseState;
  struct Measurement {
    int pose = 0;
    int camera = 0;
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
    double sigma_px = 1.0;
    double chi2 = 0;  // out: squared residual in sigmas after the solve; infinite where it does not project
  };
  struct Point {
    int host = 0;  // pose index
    SE3 T_host_anchor;
    Eigen::Vector3d bearing = Eigen::Vector3d::UnitZ();
    double inverse_depth = 0;
    double inverse_depth_sigma = 0;  // out: given the poses
    int first_measurement = 0, measurements = 0;
    // Above 0, at most 1. Below 1 where its measurements share an error: all are of the one host patch.
    double weight = 1.0;
  };

  const Rig* rig = nullptr;
  std::vector<Pose> poses;
  std::vector<Point> points;
  std::vector<Measurement> measurements;  // grouped by point
  // States that landmarks do not measure, and the factors that do. Empty for images alone.
  std::vector<MotionState> motions;
  std::vector<GlobalState> globals;
  std::vector<const StateFactor*> factors;  // owned by the caller

  [[nodiscard]] int free_poses() const {
    return static_cast<int>(
        std::count_if(poses.begin(), poses.end(), [](const Pose& pose) { return !pose.fixed; }));
  }
  [[nodiscard]] StateWindow states() const { return {poses, motions, globals}; }
  void clear() {
    poses.clear();
    points.clear();
    measurements.clear();
    motions.clear();
    globals.clear();
    factors.clear();
  }
  // Empties the problem and takes memory for this many points and measurements.
  void make_room(std::size_t point_count, std::size_t measurement_count) {
    points.assign(point_count, {});
    measurements.assign(measurement_count, {});
    clear();
  }
  // Memory of the lists that grow with points and measurements.
  [[nodiscard]] std::size_t bytes() const {
    return points.capacity() * sizeof(Point) + measurements.capacity() * sizeof(Measurement);
  }
};

struct BundleOptions {
  int iterations = 8;
  double relative_decrease = 1e-4;  // stop when an accepted step gains less than this share of the cost
};

struct BundleSummary {
  double initial_cost = 0, final_cost = 0;
  int iterations = 0;
  bool usable = false;
};

// One measurement's residual and derivatives at the present state. False where it does not project.
struct BundleLinearisation {
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, 6> d_host, d_target;  // by (dt, dphi) of se3.h
  Eigen::Vector2d d_inverse_depth;
};
[[nodiscard]] bool linearise(const BundleProblem& problem, const BundleProblem::Point& point,
                             const BundleProblem::Measurement& measurement, BundleLinearisation* out);
[[nodiscard]] bool residual(const BundleProblem& problem, const BundleProblem::Point& point,
                            const BundleProblem::Measurement& measurement, Eigen::Vector2d* out);

// Cost of a measurement that does not project (behind the camera), as of one of 100 sigmas; its derivatives
// are zero. No sane start holds a larger residual, so no step gains by moving points behind a camera.
inline constexpr double kLostCost = kHuberDelta * (100.0 - 0.5 * kHuberDelta);

// What all measurements of one pose share, computed once a pose. Rotations are matrices, axes the world's.
class BundleFrames {
 public:
  struct Body {
    Eigen::Matrix3d R_world_body;
    Eigen::Vector3d t_world_body;
  };
  struct View {  // one camera at one pose
    Eigen::Matrix3d R_camera_world;
    Eigen::Vector3d t_camera_world;
    const Camera* camera = nullptr;
  };
  // A landmark as a homogeneous world point (xyz, rho) and how xyz moves with rho.
  struct WorldPoint {
    Eigen::Vector3d xyz, d_xyz_d_inverse_depth;
    double inverse_depth = 0;
  };

  // Computes all poses of the problem. Keeps its memory from call to call.
  void update(const BundleProblem& problem);

  [[nodiscard]] const Body& body(int pose) const { return bodies_[static_cast<std::size_t>(pose)]; }
  [[nodiscard]] const View& view(const BundleProblem::Measurement& m) const {
    return views_[static_cast<std::size_t>(m.pose) * cameras_ + static_cast<std::size_t>(m.camera)];
  }
  [[nodiscard]] WorldPoint world_point(const BundleProblem::Point& point) const;
  // The same from a bearing that the caller has rotated into the host's body axes.
  [[nodiscard]] WorldPoint world_point(const BundleProblem::Point& point,
                                       const Eigen::Vector3d& bearing_body) const {
    const Body& host = body(point.host);
    WorldPoint w;
    w.inverse_depth = point.inverse_depth;
    w.d_xyz_d_inverse_depth = host.R_world_body * point.T_host_anchor.t + host.t_world_body;
    w.xyz = host.R_world_body * bearing_body + w.inverse_depth * w.d_xyz_d_inverse_depth;
    return w;
  }

 private:
  std::size_t cameras_ = 0;
  std::vector<Body> bodies_;
  std::vector<View> views_;  // pose-major
};

// One measurement's residual and derivatives by the world point, in sigmas. False where the point does not
// project.
struct WorldLinearisation {
  Eigen::Vector2d residual;
  Matrix23d d_xyz;
  Eigen::Vector2d d_inverse_depth;  // total derivative, the part through xyz included
};
[[nodiscard]] bool linearise(const BundleFrames& frames, const BundleProblem::Point& point,
                             const BundleProblem::Measurement& measurement, BundleLinearisation* out);
[[nodiscard]] bool linearise_world(const BundleFrames::WorldPoint& point, const BundleFrames::View& view,
                                   const BundleProblem::Measurement& measurement, WorldLinearisation* out);
[[nodiscard]] bool residual_world(const BundleFrames::WorldPoint& point, const BundleFrames::View& view,
                                  const BundleProblem::Measurement& measurement, Eigen::Vector2d* out);

// Minimises the cost by SchurSolver with work space of its own.
BundleSummary solve_schur(const BundleOptions& options, BundleProblem* problem);

// Sets chi2 of every measurement and sigma of every inverse depth at the present state.
void evaluate_bundle(BundleProblem* problem);

}  // namespace farpoint::slam
