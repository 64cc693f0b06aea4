// SPDX-License-Identifier: Apache-2.0
#include "slam/fusion/wheel_factor.h"

#include <gtest/gtest.h>

#include <array>
#include <deque>

#include "slam/solver/ceres_solver.h"
#include "slam/solver/schur_solver.h"
#include "slam/tracking/pose_solver.h"
#include "tests/solver/bundle_scene.h"
#include "tests/solver/factor_support.h"

namespace farpoint::slam {
namespace {

constexpr double kScale_m_per_unit = 2.5;  // of the map
constexpr double kWheelFactor = 1.03;      // tyres larger than told

// What wheels measure between two true poses, exactly.
WheelMotion motion_between(const SE3& a, const SE3& b, double scale_m_per_unit, double wheel_factor) {
  WheelMotion motion;
  const SE3 T_a_b = a.inverse() * b;
  motion.displacement_m = scale_m_per_unit / wheel_factor * T_a_b.t.head<2>();
  motion.yaw_rad = so3_log(T_a_b.q).z();
  motion.covariance << 4e-4, 1e-5, 0, 1e-5, 9e-4, 2e-5, 0, 2e-5, 1e-5;
  return motion;
}

// A drive with images and the wheels' motion from each pose to the next.
class WheelScene {
 public:
  WheelScene(const SceneOptions& options, double scale_m_per_unit, double wheel_factor)
      : scene(options), options_(options) {
    globals = {GlobalState::positive(scale_m_per_unit), GlobalState::positive(wheel_factor)};
  }

  // Factors with the globals that are asked for; the others are taken as one.
  void add_factors(bool with_scale, bool with_wheel_factor) {
    for (int i = 0; i + 1 < options_.poses; ++i) {
      const auto& poses = scene.truth.poses;
      const auto at = static_cast<std::size_t>(i);
      factors.emplace_back(WheelFactorStates{i, i + 1, with_scale ? 0 : WheelFactorStates::kNone,
                                             with_wheel_factor ? 1 : WheelFactorStates::kNone},
                           motion_between(poses[at].T_world_body, poses[at + 1].T_world_body,
                                          globals[0].value.x(), globals[1].value.x()));
    }
    for (BundleProblem* p : {&scene.truth, &scene.start}) {
      p->globals = globals;
      for (const WheelFactor& factor : factors) p->factors.push_back(&factor);
    }
  }

  BundleScene scene;
  std::vector<GlobalState> globals;
  std::deque<WheelFactor> factors;

 private:
  SceneOptions options_;
};

SceneOptions small_scene(int cameras, double noise_px) {
  SceneOptions o;
  o.poses = 10, o.points = 250, o.infinite_share = 0.0, o.far_m = 80.0;
  o.cameras = cameras, o.noise_px = noise_px;
  return o;
}

// Of the position, all axes together.
double variance_m2(const Eigen::MatrixXd& covariance) {
  return covariance.topLeftCorner(3, 3).trace();
}

TEST(WheelFactor, DerivativesMatchNumericDifferences) {
  WheelScene s(small_scene(1, 0.5), kScale_m_per_unit, kWheelFactor);
  s.add_factors(true, true);
  for (const WheelFactor& factor : s.factors) expect_jacobian(factor, s.scene.start);
  // Far from a plane, and turned by more than a small angle.
  BundleProblem p;
  p.globals = s.globals;
  for (int i = 0; i < 20; ++i) {
    p.poses = {{{so3_exp(s.scene.normal3()), s.scene.normal3()}}, {}};
    const SE3 T_a_b{so3_exp(0.7 * s.scene.normal3()), 3.0 * s.scene.normal3()};
    p.poses[1].T_world_body = p.poses[0].T_world_body * T_a_b;
    const WheelMotion motion = motion_between(SE3{}, T_a_b.boxplus(s.scene.normal6(0.1, 0.1)), 2.0, 1.0);
    expect_jacobian(WheelFactor({0, 1, 0, 1}, motion), p);
  }
}

TEST(WheelFactor, NamesOnlyTheStatesItUses) {
  const WheelMotion motion = motion_between(SE3{}, SE3{}, 1, 1);
  EXPECT_EQ(WheelFactor({0, 1}, motion).blocks().size(), 2U);
  const WheelFactor scaled({0, 1, 3}, motion);
  ASSERT_EQ(scaled.blocks().size(), 3U);
  EXPECT_EQ(scaled.blocks()[2].index, 3);
  WheelFactorStates only_wheels{0, 1};
  only_wheels.wheel_factor = 2;
  ASSERT_EQ(WheelFactor(only_wheels, motion).blocks().size(), 3U);
  EXPECT_EQ(WheelFactor(only_wheels, motion).blocks()[2].index, 2);
}

TEST(WheelFactor, ResidualIsInSigmas) {
  BundleProblem p;
  p.poses.resize(2);
  p.poses[1].T_world_body.t = {1.3, 0.2, 5.0};  // height stays free
  WheelMotion motion;
  motion.displacement_m = {1.0, 0.0};
  motion.covariance = Eigen::Vector3d(0.01, 0.04, 1e-4).asDiagonal();
  motion.yaw_rad = 0.02;
  const FactorResidual r = residual_of(WheelFactor({0, 1}, motion), p);
  EXPECT_NEAR(r[0], 3.0, 1e-12);
  EXPECT_NEAR(r[1], 1.0, 1e-12);
  EXPECT_NEAR(r[2], -2.0, 1e-12);
}

// A monocular map of unknown scale: images carry no metres, wheels do.
TEST(WheelWindow, TheScaleOfAMonocularMapComesOutRight) {
  WheelScene s(small_scene(1, 0.3), kScale_m_per_unit, 1.0);
  s.globals[1].fixed = true;
  s.add_factors(true, false);
  BundleProblem p = s.scene.start;
  p.globals[0].value.x() = 1.0;
  const BundleSummary summary = solve_schur({100, 1e-12}, &p);
  ASSERT_TRUE(summary.usable);
  EXPECT_NEAR(p.globals[0].value.x(), kScale_m_per_unit, 0.02);
  // Its sigma (of the logarithm) explains the error.
  Eigen::MatrixXd covariance;
  const std::array blocks = {StateBlock::global(0)};
  ASSERT_TRUE(SchurSolver().covariance(p, blocks, &covariance));
  const double sigma = std::sqrt(covariance(0, 0));
  EXPECT_LT(sigma, 0.01);
  EXPECT_LT(std::abs(std::log(p.globals[0].value.x() / kScale_m_per_unit)), 4.0 * sigma);
}

TEST(WheelWindow, SchurAndCeresEndAtTheSamePlace) {
  WheelScene s(small_scene(1, 0.5), kScale_m_per_unit, 1.0);
  s.globals[1].fixed = true;
  s.add_factors(true, false);
  BundleProblem a = s.scene.start, b = s.scene.start;
  a.globals[0].value.x() = b.globals[0].value.x() = 2.0;
  const BundleSummary schur = solve_schur({300, 1e-13}, &a), ceres = solve_ceres({300, 1e-13}, &b);
  ASSERT_TRUE(schur.usable && ceres.usable);
  EXPECT_NEAR(schur.initial_cost, ceres.initial_cost, 1e-9 * ceres.initial_cost);
  EXPECT_NEAR(schur.final_cost, ceres.final_cost, 1e-8 * ceres.final_cost);
  EXPECT_NEAR(a.globals[0].value.x(), b.globals[0].value.x(), 1e-5);
  for (std::size_t i = 0; i < a.poses.size(); ++i)
    EXPECT_LT(a.poses[i].T_world_body.boxminus_to(b.poses[i].T_world_body).norm(), 1e-4) << i;
}

// One slipped motion is rejected by the Huber loss.
TEST(WheelWindow, ASlippedWheelHardlyMovesTheScale) {
  WheelScene s(small_scene(1, 0.3), kScale_m_per_unit, 1.0);
  s.globals[1].fixed = true;
  s.add_factors(true, false);
  WheelMotion slipped = motion_between(s.scene.truth.poses[4].T_world_body,
                                       s.scene.truth.poses[5].T_world_body, 2.0 * kScale_m_per_unit, 1.0);
  s.factors[4] = WheelFactor({4, 5, 0}, slipped);
  BundleProblem p = s.scene.start;
  ASSERT_TRUE(solve_schur({100, 1e-12}, &p).usable);
  EXPECT_NEAR(p.globals[0].value.x(), kScale_m_per_unit, 0.05);
}

// --- two cameras, metres, wheels
// --------------------------------------------------------------------

// Two cameras with lever arms make the map metric; the wheels' own factor is then what is unknown.
TEST(MetricRigWithWheels, TheWheelFactorComesOutRight) {
  WheelScene s(small_scene(2, 0.3), 1.0, kWheelFactor);
  s.globals[0].fixed = true;
  s.add_factors(false, true);
  BundleProblem p = s.scene.start;
  p.globals[1].value.x() = 1.0;
  ASSERT_TRUE(solve_schur({100, 1e-12}, &p).usable);
  EXPECT_NEAR(p.globals[1].value.x(), kWheelFactor, 0.01);
  for (std::size_t i = 0; i < p.poses.size(); ++i)
    EXPECT_LT((p.poses[i].T_world_body.t - s.scene.truth.poses[i].T_world_body.t).norm(), 0.05) << i;
}

// With one pose fixed, metres can come from the lever arms or the wheels alone.
TEST(MetricRigWithWheels, WheelsHoldTheMetresWhereOnlyOnePoseIsFixed) {
  SceneOptions options = small_scene(2, 0.3);
  options.fixed = 1;
  WheelScene s(options, 1.0, 1.0);
  BundleProblem images = s.scene.start;
  s.globals[0].fixed = s.globals[1].fixed = true;
  s.add_factors(false, false);
  BundleProblem wheels = s.scene.start;
  ASSERT_TRUE(solve_schur({100, 1e-12}, &wheels).usable);
  const auto drive_m = [](const BundleProblem& p) {
    return (p.poses.back().T_world_body.t - p.poses.front().T_world_body.t).norm();
  };
  EXPECT_NEAR(drive_m(wheels), drive_m(s.scene.truth), 0.05);
  const std::array blocks = {StateBlock::pose(options.poses - 1)};
  Eigen::MatrixXd with, without;
  ASSERT_TRUE(SchurSolver().covariance(wheels, blocks, &with));
  ASSERT_TRUE(solve_schur({100, 1e-12}, &images).usable);
  ASSERT_TRUE(SchurSolver().covariance(images, blocks, &without));
  EXPECT_LT(variance_m2(with), variance_m2(without));
}

// Tracking the next frame: the pose before and the wheels' motion are the prior, images of both cameras the
// measurements.
TEST(MetricRigWithWheels, WheelsCarryThePoseSolverWhereImagesLeaveTranslationOpen) {
  SceneOptions options = small_scene(2, 0.0);
  options.far_m = 4000.0;
  BundleScene scene(options);
  const int before = 5, now = 6;
  const SE3& T_before = scene.truth.poses[before].T_world_body;
  const SE3& T_now = scene.truth.poses[now].T_world_body;
  BundleFrames frames;
  frames.update(scene.truth);
  std::vector<PoseMeasurement> measurements;
  bool cameras[2] = {false, false};
  for (const auto& point : scene.truth.points) {
    if (point.inverse_depth > 1.0 / 1000.0) continue;  // far ones alone
    for (int i = 0; i < point.measurements; ++i) {
      const int index = point.first_measurement + i;
      const auto& seen = scene.truth.measurements[static_cast<std::size_t>(index)];
      if (seen.pose != now) continue;
      const BundleFrames::WorldPoint world = frames.world_point(point);
      PoseMeasurement m;
      m.point_w << world.xyz, world.inverse_depth;
      m.anchor_w = world.d_xyz_d_inverse_depth;
      m.pixel = seen.pixel + 0.3 * Eigen::Vector2d(scene.normal(), scene.normal());
      m.sigma_px = 0.3;
      m.camera = seen.camera;
      cameras[seen.camera] = true;
      measurements.push_back(m);
    }
  }
  ASSERT_GT(measurements.size(), 10U);
  ASSERT_TRUE(cameras[0] && cameras[1]);
  const WheelMotion wheels = motion_between(T_before, T_now, 1.0, 1.0);
  PosePrior prior;
  prior.T_world_body = T_before * SE3{so3_exp({0, 0, wheels.yaw_rad}),
                                      {wheels.displacement_m.x(), wheels.displacement_m.y(),
                                       (T_before.inverse() * T_now).t.z()}};
  auto images = measurements;
  const PoseSolution alone = solve_pose(scene.rig, prior.T_world_body, images);
  prior.information.topLeftCorner<3, 3>() = Eigen::Vector3d(1 / 4e-4, 1 / 9e-4, 1 / 4e-2).asDiagonal();
  const PoseSolution s = solve_pose(scene.rig, prior, measurements);
  ASSERT_TRUE(alone.ok && s.ok);
  EXPECT_LT((s.T_world_body.t - T_now.t).norm(), 0.1);
  EXPECT_GT((alone.T_world_body.t - T_now.t).norm(), 3.0 * (s.T_world_body.t - T_now.t).norm());
  EXPECT_LT(s.T_world_body.boxminus_to(T_now).tail<3>().norm(), 2e-3);  // by the far points
  EXPECT_LT(variance_m2(s.covariance), 0.05);
  EXPECT_GT(variance_m2(alone.covariance), 0.1);
}

}  // namespace
}  // namespace farpoint::slam
