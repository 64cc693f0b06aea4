// Bundle adjustment over body poses and host-anchored inverse depths, as plain arrays: what the solvers share.
//
// Residual of one measurement, in units of its sigma:
//     r = (project_c(T_camera_body T_body_world T_world_host T_host_anchor (f, rho)) - z) / sigma,     2x1
// with homogeneous points (f, rho), so that a landmark at infinity (rho = 0) is as well conditioned as a near one.
// Cost: sum of Huber losses of |r|, delta = kHuberDelta.
#pragma once

#include <vector>

#include "slam/config.h"
#include "slam/geometry/se3.h"

namespace farpoint::slam {

struct BundleProblem {
  struct Pose {
    SE3 T_world_body;
    bool fixed = false;
  };
  struct Measurement {
    int pose = 0;
    int camera = 0;
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
    double sigma_px = 1.0;
    double chi2 = 0;    // out: squared residual in sigmas after the solve; infinite where it does not project
  };
  struct Point {
    int host = 0;       // pose index
    SE3 T_host_anchor;
    Eigen::Vector3d bearing = Eigen::Vector3d::UnitZ();
    double inverse_depth = 0;
    double inverse_depth_sigma = 0;    // out: given the poses
    int first_measurement = 0, measurements = 0;
  };

  const Rig* rig = nullptr;
  std::vector<Pose> poses;
  std::vector<Point> points;
  std::vector<Measurement> measurements;    // grouped by point

  void clear() {
    poses.clear();
    points.clear();
    measurements.clear();
  }
};

struct BundleOptions {
  int iterations = 8;
  double relative_decrease = 1e-4;    // stop when an accepted step gains less than this share of the cost
};

struct BundleSummary {
  double initial_cost = 0, final_cost = 0;
  int iterations = 0;
  bool usable = false;
};

// 95 % quantile of chi-square with two degrees of freedom: beyond it a measurement counts as an outlier.
inline constexpr double kChi2TwoDof = 5.991;
inline constexpr double kHuberDelta = 2.4477;    // sqrt(kChi2TwoDof)

// One measurement's residual and derivatives at the present state. False where it does not project.
struct BundleLinearisation {
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, 6> d_host, d_target;    // by (dt, dphi) of se3.h
  Eigen::Vector2d d_inverse_depth;
};
[[nodiscard]] bool linearise(const BundleProblem& problem, const BundleProblem::Point& point,
                             const BundleProblem::Measurement& measurement, BundleLinearisation* out);
[[nodiscard]] bool residual(const BundleProblem& problem, const BundleProblem::Point& point,
                            const BundleProblem::Measurement& measurement, Eigen::Vector2d* out);

// Levenberg-Marquardt with the inverse depths eliminated first (Schur complement): one thread, no time limit, the same
// bytes every time.
BundleSummary solve_schur(const BundleOptions& options, BundleProblem* problem);
// The same cost by Ceres; the reference the tests hold solve_schur to.
BundleSummary solve_ceres(const BundleOptions& options, BundleProblem* problem);

// Fills chi2 of every measurement and sigma of every inverse depth at the present state.
void evaluate_bundle(BundleProblem* problem);

}  // namespace farpoint::slam
