// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "slam/solver/bundle_problem.h"
#include "slam/solver/ceres_solver.h"
#include "slam/solver/schur_solver.h"
#include "tests/solver/bundle_scene.h"

namespace farpoint::slam {
namespace {

using Solver = BundleSummary (*)(const BundleOptions&, BundleProblem*);
constexpr BundleOptions kToTheEnd{300, 1e-13};

// Every bit of the state and of what evaluate_bundle adds.
std::vector<std::uint64_t> bits(const BundleProblem& p) {
  std::vector<std::uint64_t> out;
  const auto add = [&](double v) { out.push_back(std::bit_cast<std::uint64_t>(v)); };
  for (const auto& pose : p.poses) {
    for (int i = 0; i < 4; ++i) add(pose.T_world_body.q.coeffs()[i]);
    for (int i = 0; i < 3; ++i) add(pose.T_world_body.t[i]);
  }
  for (const auto& point : p.points) add(point.inverse_depth), add(point.inverse_depth_sigma);
  for (const auto& m : p.measurements) add(m.chi2);
  return out;
}

double huber(double squared) {
  const double r = std::sqrt(squared);
  return r <= kHuberDelta ? 0.5 * squared : kHuberDelta * (r - 0.5 * kHuberDelta);
}

double cost_of(const BundleProblem& p) {
  double sum = 0;
  for (const auto& point : p.points)
    for (int i = 0; i < point.measurements; ++i) {
      Eigen::Vector2d r;
      const int index = point.first_measurement + i;
      const auto& m = p.measurements[static_cast<std::size_t>(index)];
      sum += residual(p, point, m, &r) ? huber(r.squaredNorm()) : kLostCost;
    }
  return sum;
}

// Largest translation (m) and rotation (rad) between two problems' poses.
double largest_shift_m(const BundleProblem& a, const BundleProblem& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.poses.size(); ++i)
    worst = std::max(worst, (a.poses[i].T_world_body.t - b.poses[i].T_world_body.t).norm());
  return worst;
}
double largest_turn_rad(const BundleProblem& a, const BundleProblem& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.poses.size(); ++i)
    worst = std::max(worst, a.poses[i].T_world_body.boxminus_to(b.poses[i].T_world_body).tail<3>().norm());
  return worst;
}
double largest_depth_change(const BundleProblem& a, const BundleProblem& b) {
  double worst = 0;
  for (std::size_t k = 0; k < a.points.size(); ++k)
    worst = std::max(worst, std::abs(a.points[k].inverse_depth - b.points[k].inverse_depth));
  return worst;
}

// --- derivatives
// -------------------------------------------------------------------------------------------------

// Residual after moving the host, the target and the inverse depth.
Eigen::Vector2d moved_residual(const BundleProblem& problem, const BundleProblem::Point& point,
                               const BundleProblem::Measurement& m, const Vector6d& host,
                               const Vector6d& target, double inverse_depth) {
  BundleProblem p = problem;
  SE3& T_host = p.poses[static_cast<std::size_t>(point.host)].T_world_body;
  T_host = T_host.boxplus(host);
  SE3& T_target = p.poses[static_cast<std::size_t>(m.pose)].T_world_body;
  T_target = T_target.boxplus(target);
  BundleProblem::Point q = point;
  q.inverse_depth += inverse_depth;
  Eigen::Vector2d r;
  EXPECT_TRUE(residual(p, q, m, &r));
  return r;
}

void expect_derivatives(const BundleProblem& small, const BundleProblem::Point& point,
                        const BundleProblem::Measurement& m) {
  BundleLinearisation lin;
  ASSERT_TRUE(linearise(small, point, m, &lin));
  constexpr double kStep = 1e-6;
  const auto difference = [&](const Vector6d& host, const Vector6d& target, double rho) {
    return Eigen::Vector2d((moved_residual(small, point, m, kStep * host, kStep * target, kStep * rho) -
                            moved_residual(small, point, m, -kStep * host, -kStep * target, -kStep * rho)) /
                           (2.0 * kStep));
  };
  const Vector6d zero = Vector6d::Zero();
  for (int i = 0; i < 6; ++i) {
    const Vector6d axis = Vector6d::Unit(i);
    const double tolerance = 2e-6 * (1.0 + lin.d_host.norm() + lin.d_target.norm());
    if (point.host == m.pose) {
      EXPECT_LT(difference(axis, zero, 0).norm(), tolerance) << "shared pose, axis " << i;
      continue;
    }
    EXPECT_LT((difference(axis, zero, 0) - lin.d_host.col(i)).norm(), tolerance) << "host, axis " << i;
    EXPECT_LT((difference(zero, axis, 0) - lin.d_target.col(i)).norm(), tolerance) << "target, axis " << i;
  }
  EXPECT_LT((difference(zero, zero, 1) - lin.d_inverse_depth).norm(),
            2e-6 * (1.0 + lin.d_inverse_depth.norm()));
  Eigen::Vector2d r;
  ASSERT_TRUE(residual(small, point, m, &r));
  EXPECT_LT((r - lin.residual).norm(), 1e-12 * (1.0 + r.norm()));
}

TEST(BundleLinearise, MatchesNumericDifferences) {
  SceneOptions options;
  options.poses = 6, options.points = 120, options.cameras = 2;
  options.infinite_share = 0.3, options.rehosted_share = 0.4;
  BundleScene scene(options);
  int at_infinity = 0, shared = 0, second_camera = 0;
  BundleProblem small;  // poses only: copied for every difference
  small.rig = &scene.rig;
  small.poses = scene.start.poses;
  for (auto point : scene.start.points) {
    // Half of the far points exactly at infinity; the difference quotient then steps beyond it, which
    // residual() can.
    if (point.inverse_depth < 1e-3) point.inverse_depth = 0;
    for (int i = 0; i < point.measurements; ++i) {
      const int index = point.first_measurement + i;
      auto m = scene.start.measurements[static_cast<std::size_t>(index)];
      m.sigma_px = 0.3 + 0.1 * i;
      at_infinity += point.inverse_depth == 0 ? 1 : 0;
      shared += point.host == m.pose ? 1 : 0;
      second_camera += m.camera;
      expect_derivatives(small, point, m);
      if (HasFailure()) return;
    }
  }
  EXPECT_GT(at_infinity, 50);
  EXPECT_GT(shared, 20);
  EXPECT_GT(second_camera, 100);
}

TEST(BundleLinearise, FramesGiveTheSameAsPosesAlone) {
  SceneOptions options;
  options.poses = 6, options.points = 50, options.cameras = 2;
  BundleScene scene(options);
  BundleFrames frames;
  frames.update(scene.start);
  for (const auto& point : scene.start.points) {
    const auto& m = scene.start.measurements[static_cast<std::size_t>(point.first_measurement)];
    BundleLinearisation a, b;
    ASSERT_TRUE(linearise(scene.start, point, m, &a));
    ASSERT_TRUE(linearise(frames, point, m, &b));
    EXPECT_EQ(a.residual, b.residual);
    EXPECT_EQ(a.d_host, b.d_host);
    EXPECT_EQ(a.d_target, b.d_target);
    EXPECT_EQ(a.d_inverse_depth, b.d_inverse_depth);
  }
}

TEST(BundleLinearise, SaysWhereAPointIsBehind) {
  BundleScene scene(SceneOptions{});
  BundleProblem::Point behind;
  behind.T_host_anchor = scene.rig.cameras[0].T_body_camera;
  behind.bearing = -Eigen::Vector3d::UnitZ();
  behind.inverse_depth = 0.01;
  BundleProblem::Measurement m;
  m.pose = 1;
  BundleLinearisation lin;
  Eigen::Vector2d r;
  EXPECT_FALSE(linearise(scene.start, behind, m, &lin));
  EXPECT_FALSE(residual(scene.start, behind, m, &r));
}

// --- both solvers alike
// --------------------------------------------------------------------------------------------

class BundleSolver : public testing::TestWithParam<Solver> {};
INSTANTIATE_TEST_SUITE_P(Both, BundleSolver, testing::Values(&solve_schur, &solve_ceres),
                         [](const auto& info) { return info.param == &solve_schur ? "schur" : "ceres"; });

TEST_P(BundleSolver, RecoversTruthWithoutNoise) {
  SceneOptions options;
  options.poses = 12, options.points = 400, options.cameras = 2;
  options.noise_px = 0.0;
  BundleScene scene(options);
  BundleProblem p = scene.start;
  EXPECT_GT(largest_shift_m(p, scene.truth), 0.05);
  const BundleSummary s = GetParam()({60, 1e-30}, &p);
  EXPECT_TRUE(s.usable);
  EXPECT_GT(s.initial_cost, 1e4);
  EXPECT_LT(s.final_cost, 1e-9);
  EXPECT_LT(largest_shift_m(p, scene.truth), 1e-6);
  EXPECT_LT(largest_turn_rad(p, scene.truth), 1e-7);
  EXPECT_LT(largest_depth_change(p, scene.truth), 1e-7);
}

TEST_P(BundleSolver, ReportsItsOwnCost) {
  SceneOptions options;
  options.points = 200, options.outlier_share = 0.1;
  BundleScene scene(options);
  BundleProblem p = scene.start;
  const double before = cost_of(p);
  const BundleSummary s = GetParam()({5, 0.0}, &p);
  EXPECT_NEAR(s.initial_cost, before, 1e-9 * before);
  EXPECT_NEAR(s.final_cost, cost_of(p), 1e-9 * s.final_cost);
  EXPECT_LT(s.final_cost, s.initial_cost);
  EXPECT_GE(s.iterations, 1);
  EXPECT_LE(s.iterations, 5);
}

TEST_P(BundleSolver, GivesTheSameBytesTwice) {
  SceneOptions options;
  options.points = 300, options.outlier_share = 0.05;
  BundleScene scene(options);
  BundleProblem a = scene.start, b = scene.start;
  GetParam()({8, 1e-4}, &a);
  GetParam()({8, 1e-4}, &b);
  EXPECT_EQ(bits(a), bits(b));
  EXPECT_NE(bits(a), bits(scene.start));
}

TEST_P(BundleSolver, FixedPosesStay) {
  SceneOptions options;
  options.points = 300, options.fixed = 5;
  BundleScene scene(options);
  BundleProblem p = scene.start;
  GetParam()({8, 1e-4}, &p);
  for (std::size_t i = 0; i < p.poses.size(); ++i) {
    const SE3 &was = scene.start.poses[i].T_world_body, &is = p.poses[i].T_world_body;
    EXPECT_EQ(was.q.coeffs() == is.q.coeffs() && was.t == is.t, i < 5) << "pose " << i;
  }
}

TEST_P(BundleSolver, AllPosesFixedSolvesEveryPointAlone) {
  SceneOptions options;
  options.points = 200, options.fixed = 20, options.noise_px = 0.0, options.infinite_share = 0.0;
  BundleScene scene(options);
  BundleProblem p = scene.start;
  const BundleSummary s = GetParam()({60, 1e-30}, &p);
  EXPECT_TRUE(s.usable);
  EXPECT_LT(s.final_cost, 1e-12);
  EXPECT_LT(largest_depth_change(p, scene.truth), 1e-9);
  EXPECT_EQ(largest_shift_m(p, scene.truth), 0.0);
}

TEST_P(BundleSolver, NoPoints) {
  BundleScene scene(SceneOptions{});
  BundleProblem p = scene.start;
  p.points.clear();
  p.measurements.clear();
  const BundleSummary s = GetParam()({8, 1e-4}, &p);
  EXPECT_TRUE(s.usable);
  EXPECT_EQ(s.final_cost, 0.0);
  EXPECT_EQ(largest_shift_m(p, scene.start), 0.0);
}

TEST_P(BundleSolver, NothingAtAll) {
  BundleScene scene(SceneOptions{});
  BundleProblem p;
  p.rig = &scene.rig;
  const BundleSummary s = GetParam()({8, 1e-4}, &p);
  EXPECT_TRUE(s.usable);
  EXPECT_EQ(s.final_cost, 0.0);
}

TEST_P(BundleSolver, APointWithoutAnyValidMeasurementDisturbsNothing) {
  SceneOptions options;
  options.points = 300;
  BundleScene scene(options);
  BundleProblem clean = scene.start, p = scene.start;
  // One never measured, one measured only from where it is behind the camera.
  BundleProblem::Point unseen;
  unseen.host = 3;
  unseen.inverse_depth = 0.1;
  unseen.first_measurement = static_cast<int>(p.measurements.size());
  p.points.push_back(unseen);
  BundleProblem::Point behind = unseen;
  behind.T_host_anchor = scene.rig.cameras[0].T_body_camera;
  behind.bearing = -Eigen::Vector3d::UnitZ();
  behind.measurements = 1;
  BundleProblem::Measurement m;
  m.pose = 4;
  p.points.push_back(behind);
  p.measurements.push_back(m);

  const BundleSummary with = GetParam()({8, 1e-6}, &p);
  const BundleSummary without = GetParam()({8, 1e-6}, &clean);
  EXPECT_TRUE(with.usable);
  EXPECT_NEAR(with.final_cost, without.final_cost + kLostCost, 1e-6 * with.final_cost);
  EXPECT_LT(largest_shift_m(p, clean), 1e-6);
  for (std::size_t k = p.points.size() - 2; k < p.points.size(); ++k) {
    EXPECT_EQ(p.points[k].inverse_depth, 0.1);
    EXPECT_EQ(p.points[k].inverse_depth_sigma, 1e6);
  }
  EXPECT_EQ(p.measurements.back().chi2, std::numeric_limits<double>::infinity());
}

TEST_P(BundleSolver, NoFixedPoseStillDescends) {
  SceneOptions options;
  options.points = 300, options.fixed = 0;
  BundleScene scene(options);
  BundleProblem p = scene.start;
  const BundleSummary s = GetParam()({20, 1e-9}, &p);
  EXPECT_TRUE(s.usable);
  // Seven directions hold nothing; the reprojection errors go down all the same, to what their noise leaves.
  EXPECT_LT(s.final_cost, 1.1 * static_cast<double>(p.measurements.size()));
  for (const auto& pose : p.poses) EXPECT_TRUE(pose.T_world_body.is_finite());
}

TEST_P(BundleSolver, AnchorsInTheirOwnObserverHoldOnlyDepth) {
  // One re-hosted landmark, measured by its host alone: its depth comes from anchor and host camera; no pose
  // may move.
  BundleScene scene(SceneOptions{});
  BundleProblem p = scene.truth;
  p.points.clear();
  p.measurements.clear();
  BundleProblem::Point point;
  point.host = 5;
  point.T_host_anchor =
      scene.rig.cameras[0].T_body_camera.boxplus((Vector6d() << 0.5, 0.1, 0, 0, 0, 0).finished());
  point.inverse_depth = 0.2;
  point.measurements = 1;
  BundleProblem::Measurement m;
  m.pose = 5;
  ASSERT_TRUE(residual(p, point, m, &m.pixel));
  point.inverse_depth = 0.1;
  p.points.push_back(point);
  p.measurements.push_back(m);
  const BundleSummary s = GetParam()({50, 1e-30}, &p);
  EXPECT_TRUE(s.usable);
  EXPECT_NEAR(p.points[0].inverse_depth, 0.2, 1e-9);
  EXPECT_EQ(largest_shift_m(p, scene.truth), 0.0);
}

TEST_P(BundleSolver, MeasurementsThatStartBehindTheCameraCostAConstant) {
  SceneOptions options;
  options.points = 300, options.noise_px = 0.3;
  BundleScene scene(options);
  BundleProblem p = scene.start;
  // So near that the drive passes it: later cameras look away from it.
  int lost = 0;
  for (auto& point : p.points)
    if (point.host == 2 && point.inverse_depth > 0.05) point.inverse_depth = 5.0, ++lost;
  ASSERT_GE(lost, 2);
  const double before = cost_of(p);
  const BundleSummary s = GetParam()({100, 1e-10}, &p);
  EXPECT_TRUE(s.usable);
  EXPECT_LT(s.final_cost, before);
  EXPECT_NEAR(s.final_cost, cost_of(p), 1e-9 * s.final_cost);
  EXPECT_LT(largest_shift_m(p, scene.truth), 0.05);
}

// --- the optimum
// ---------------------------------------------------------------------------------------------

SceneOptions scene_options(std::uint64_t seed, int fixed, double outliers, int cameras) {
  SceneOptions o;
  o.seed = seed, o.fixed = fixed, o.outlier_share = outliers, o.cameras = cameras;
  return o;
}
SceneOptions near_scene(std::uint64_t seed, int fixed, double outliers, int cameras) {
  SceneOptions o = scene_options(seed, fixed, outliers, cameras);
  o.infinite_share = 0.0, o.far_m = 60.0;
  return o;
}
SceneOptions weighted_scene(std::uint64_t seed) {
  SceneOptions o = near_scene(seed, 2, 0.05, 1);
  o.least_weight = 0.05;
  return o;
}
SceneOptions far_scene(std::uint64_t seed) {
  SceneOptions o = scene_options(seed, 8, 0.05, 1);
  o.infinite_share = 0.6;
  return o;
}

// Gradient of the cost by everything that may move, each entry in units of its own curvature's root. It is
// the state's distance from the optimum along each axis alone, in sigmas. Inverse depths at zero whose
// gradient points below zero count as optimal.
double distance_from_optimum(const BundleProblem& p) {
  std::vector<Vector6d> pose_gradient(p.poses.size(), Vector6d::Zero());
  std::vector<Vector6d> pose_curvature(p.poses.size(), Vector6d::Zero());
  double worst = 0;
  for (const auto& point : p.points) {
    double gradient = 0, curvature = 0;
    for (int i = 0; i < point.measurements; ++i) {
      const int index = point.first_measurement + i;
      const auto& m = p.measurements[static_cast<std::size_t>(index)];
      BundleLinearisation lin;
      if (!linearise(p, point, m, &lin)) continue;
      const double r = lin.residual.norm();
      const double w = point.weight * (r <= kHuberDelta ? 1.0 : kHuberDelta / r);
      const auto add = [&](int pose, const Eigen::Matrix<double, 2, 6>& J) {
        pose_gradient[static_cast<std::size_t>(pose)] += w * J.transpose() * lin.residual;
        pose_curvature[static_cast<std::size_t>(pose)] += w * J.colwise().squaredNorm().transpose();
      };
      add(point.host, lin.d_host);
      add(m.pose, lin.d_target);
      gradient += w * lin.d_inverse_depth.dot(lin.residual);
      curvature += w * lin.d_inverse_depth.squaredNorm();
    }
    if (curvature > 0 && !(point.inverse_depth == 0 && gradient > 0))
      worst = std::max(worst, std::abs(gradient) / std::sqrt(curvature));
  }
  for (std::size_t i = 0; i < p.poses.size(); ++i)
    if (!p.poses[i].fixed)
      for (int k = 0; k < 6; ++k)
        worst = std::max(worst, std::abs(pose_gradient[i][k]) / std::sqrt(pose_curvature[i][k]));
  return worst;
}

struct Comparison {
  const char* name;
  SceneOptions scene;
  bool bounded;  // some inverse depths end at zero
};
void PrintTo(const Comparison& c, std::ostream* out) {  // NOLINT(readability-identifier-naming)
  *out << c.name;
}

class BundleComparison : public testing::TestWithParam<Comparison> {};
INSTANTIATE_TEST_SUITE_P(Scenes, BundleComparison,
                         testing::Values(Comparison{"near_clean", near_scene(1, 2, 0.0, 1), false},
                                         Comparison{"near_outliers", near_scene(2, 3, 0.1, 1), false},
                                         Comparison{"near_two_cameras", near_scene(3, 2, 0.05, 2), false},
                                         Comparison{"near_weighted", weighted_scene(6), false},
                                         Comparison{"all_depths", scene_options(4, 2, 0.05, 1), true},
                                         Comparison{"mostly_infinite", far_scene(5), true}),
                         [](const auto& info) { return info.param.name; });

TEST_P(BundleComparison, SchurAndCeresEndAtTheSamePlace) {
  BundleScene scene(GetParam().scene);
  BundleProblem a = scene.start, b = scene.start;
  const BundleSummary schur = solve_schur(kToTheEnd, &a);
  const BundleSummary ceres = solve_ceres(kToTheEnd, &b);
  ASSERT_TRUE(schur.usable);
  ASSERT_TRUE(ceres.usable);
  RecordProperty("schur_iterations", schur.iterations);
  RecordProperty("ceres_iterations", ceres.iterations);
  EXPECT_NEAR(schur.initial_cost, ceres.initial_cost, 1e-9 * ceres.initial_cost);
  EXPECT_LT(schur.final_cost, 0.5 * schur.initial_cost);
  EXPECT_LT(distance_from_optimum(a), 1e-3);
  const auto at_zero = [](const auto& point) { return point.inverse_depth == 0.0; };
  EXPECT_EQ(std::any_of(a.points.begin(), a.points.end(), at_zero), GetParam().bounded);
  // At active bounds Ceres's line search ends early: there only the costs are compared, and Ceres's must not
  // be lower.
  EXPECT_LT(schur.final_cost, ceres.final_cost * (1.0 + 1e-9));
  EXPECT_NEAR(schur.final_cost, ceres.final_cost, (GetParam().bounded ? 1e-4 : 1e-8) * ceres.final_cost);
  EXPECT_LT(largest_shift_m(a, b), GetParam().bounded ? 5e-3 : 1e-4);
  EXPECT_LT(largest_turn_rad(a, b), GetParam().bounded ? 2e-4 : 1e-5);
  for (std::size_t k = 0; k < a.points.size(); ++k)
    EXPECT_NEAR(a.points[k].inverse_depth, b.points[k].inverse_depth,
                (GetParam().bounded ? 0.5 : 0.02) * a.points[k].inverse_depth_sigma)
        << k;
  // Outliers or not, the truth is near: that is what the loss is for.
  EXPECT_LT(largest_shift_m(a, scene.truth), 0.1);
}

TEST_P(BundleComparison, CeresFindsNothingLeftToDo) {
  BundleScene scene(GetParam().scene);
  BundleProblem p = scene.start;
  const BundleSummary schur = solve_schur(kToTheEnd, &p);
  const BundleProblem before = p;
  const BundleSummary ceres = solve_ceres(kToTheEnd, &p);
  EXPECT_NEAR(ceres.initial_cost, schur.final_cost, 1e-9 * schur.final_cost);
  EXPECT_NEAR(ceres.final_cost, schur.final_cost, 1e-8 * schur.final_cost);
  EXPECT_LT(largest_shift_m(p, before), 1e-5);
  EXPECT_LT(largest_turn_rad(p, before), 1e-6);
}

TEST(BundleSolverBudget, MappingsEightIterationsAreEnough) {
  SceneOptions options = scene_options(5, 2, 0.05, 1);
  BundleScene scene(options);
  BundleProblem a = scene.start, b = scene.start, end = scene.start;
  const BundleSummary schur = solve_schur({}, &a);
  const BundleSummary ceres = solve_ceres({}, &b);
  const BundleSummary best = solve_schur(kToTheEnd, &end);
  EXPECT_LT(schur.final_cost, 1.01 * best.final_cost);
  EXPECT_LT(schur.final_cost, 1.01 * ceres.final_cost);
}

TEST(SchurSolver, NothingOfOneProblemIsLeftForTheNext) {
  const BundleScene large(scene_options(5, 2, 0.05, 1)), small(near_scene(2, 3, 0.1, 1));
  SchurSolver solver(100, 100);  // too little room: it must not matter
  for (const BundleScene* scene : {&large, &small, &large}) {
    BundleProblem kept = scene->start, fresh = scene->start;
    const BundleSummary a = solver.solve({}, &kept), b = solve_schur({}, &fresh);
    EXPECT_EQ(a.final_cost, b.final_cost);
    for (std::size_t i = 0; i < kept.poses.size(); ++i)
      EXPECT_EQ(kept.poses[i].T_world_body.t, fresh.poses[i].T_world_body.t) << i;
    for (std::size_t k = 0; k < kept.points.size(); ++k)
      EXPECT_EQ(kept.points[k].inverse_depth, fresh.points[k].inverse_depth) << k;
  }
}

// --- evaluate_bundle
// ---------------------------------------------------------------------------------------

TEST(EvaluateBundle, SigmaIsRight) {
  SceneOptions options;
  options.poses = 10, options.fixed = 10, options.points = 6000;
  options.infinite_share = 0.0, options.start_log_depth = 0.05;
  BundleScene scene(options);
  BundleProblem p = scene.start;
  solve_schur({50, 1e-12}, &p);
  double sum = 0, squares = 0;
  int n = 0, within = 0;
  for (std::size_t k = 0; k < p.points.size(); ++k) {
    // Where infinity is near, the clamp at zero cuts the distribution.
    if (scene.truth.points[k].inverse_depth < 6.0 * p.points[k].inverse_depth_sigma) continue;
    const double e =
        (p.points[k].inverse_depth - scene.truth.points[k].inverse_depth) / p.points[k].inverse_depth_sigma;
    sum += e, squares += e * e, ++n;
    within += std::abs(e) < 1.959964 ? 1 : 0;
  }
  ASSERT_GT(n, 2000);
  RecordProperty("normalised_variance", std::to_string(squares / n));
  EXPECT_NEAR(sum / n, 0.0, 0.08);
  EXPECT_NEAR(squares / n, 1.0, 0.1);
  EXPECT_NEAR(static_cast<double>(within) / n, 0.95, 0.015);
}

TEST(EvaluateBundle, ChiSquareIsTheSquaredResidual) {
  SceneOptions options;
  options.points = 100;
  BundleScene scene(options);
  BundleProblem p = scene.start;
  evaluate_bundle(&p);
  for (const auto& point : p.points) {
    double information = 0;
    for (int i = 0; i < point.measurements; ++i) {
      const int index = point.first_measurement + i;
      const auto& m = p.measurements[static_cast<std::size_t>(index)];
      BundleLinearisation lin;
      ASSERT_TRUE(linearise(p, point, m, &lin));
      EXPECT_NEAR(m.chi2, lin.residual.squaredNorm(), 1e-12 * (1 + m.chi2));
      if (m.chi2 < kChi2TwoDof) information += lin.d_inverse_depth.squaredNorm();
    }
    EXPECT_NEAR(point.inverse_depth_sigma, information > 0 ? 1.0 / std::sqrt(information) : 1e6,
                1e-9 * point.inverse_depth_sigma);
  }
}

}  // namespace
}  // namespace farpoint::slam
