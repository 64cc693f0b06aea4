// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/soundness.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "slam/solver/schur_solver.h"
#include "tests/solver/bundle_scene.h"

namespace farpoint::slam {
namespace {

// Of a scene whose measurements something moves, by a displacement in pixels, after bundle adjustment has
// done what it can to explain that.
using Displacement = std::function<Eigen::Vector2d(const BundleProblem::Measurement& m)>;

Soundness adjusted(const SceneOptions& options, const Displacement& displacement) {
  BundleScene scene(options);
  BundleProblem& p = scene.start;
  for (auto& m : p.measurements) m.pixel += displacement(m);
  BundleOptions solver;
  solver.iterations = 20;
  EXPECT_TRUE(solve_schur(solver, &p).usable);
  evaluate_bundle(&p);
  return soundness_of(p);
}

Eigen::Vector2d nowhere(const BundleProblem::Measurement& /*m*/) {
  return Eigen::Vector2d::Zero();
}

// The camera turns about its vertical axis while it reads its rows: here to one side, there to the other.
Eigen::Vector2d rolling_shutter(const BundleProblem::Measurement& m) {
  const double turn_px = 2.0 * ((m.pose % 3) - 1);
  return {turn_px * (m.pixel.y() / 480.0 - 0.5), 0.0};
}

// A shift of the whole image that grows from row to row, 0.1 px RMS, to one side and to the other by turns:
// no pose explains it.
Eigen::Vector2d tenth_of_a_pixel(const BundleProblem::Measurement& m) {
  const double rms_of_rows = 1.0 / std::sqrt(12.0);
  return {0.1 / rms_of_rows * (m.pose % 2 == 0 ? 1.0 : -1.0) * (m.pixel.y() / 480.0 - 0.5), 0.0};
}

TEST(Soundness, AnExactModelWithExactSigmasIsSound) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    SceneOptions options;
    options.seed = seed;
    const Soundness sound = adjusted(options, nowhere);
    EXPECT_EQ(sound.refusal(false).reason, Reason::kNone);
    EXPECT_LT(sound.field_px, 0.05);
    // The adjustment fits a part of the errors itself.
    EXPECT_GT(sound.noise_sigmas, 0.8);
    EXPECT_LT(sound.noise_sigmas, 1.1);
    EXPECT_NEAR(sound.excess, 1.0, 0.15);
  }
}

TEST(Soundness, NoFieldIsFoundWhateverTheWeights) {
  for (const std::uint64_t seed : {5U, 6U, 7U}) {
    SceneOptions options;
    options.seed = seed;
    options.least_weight = 0.002;
    EXPECT_LT(adjusted(options, nowhere).field_px, 0.08);
  }
}

TEST(Soundness, NoiseIsMeasuredFromTheResiduals) {
  SceneOptions options;
  options.noise_px = 0.1;
  const Soundness small = adjusted(options, nowhere);
  options.noise_px = 0.3;
  const Soundness large = adjusted(options, nowhere);
  EXPECT_NEAR(large.noise_px / small.noise_px, 3.0, 0.3);
  EXPECT_NEAR(small.noise_px, 0.1, 0.02);
  EXPECT_NEAR(large.excess, small.excess, 0.15);
}

// An F statistic would grow with the number of measurements, and forbid with 5000 what it allows with 400.
TEST(Soundness, AFieldIsAsLargeWhateverTheNumberOfPoints) {
  SceneOptions options;
  options.points = 400;
  const double few_px = adjusted(options, tenth_of_a_pixel).field_px;
  options.points = 5000;
  const double many_px = adjusted(options, tenth_of_a_pixel).field_px;
  EXPECT_NEAR(few_px, many_px, 0.03);
  EXPECT_GT(many_px, 0.03);
  EXPECT_LT(many_px, 0.12);
}

TEST(Soundness, ARollingShutterIsAField) {
  const Soundness bent = adjusted(SceneOptions{}, rolling_shutter);
  EXPECT_GT(bent.field_px, 0.25);
  EXPECT_EQ(bent.refusal(true).reason, Reason::kField);
  EXPECT_DOUBLE_EQ(bent.refusal(true).value, bent.field_px);
}

TEST(Soundness, WrongMatchesAreExcess) {
  const Soundness wrong = adjusted(SceneOptions{}, [](const BundleProblem::Measurement& m) {
    const auto cell = static_cast<int>(m.pixel.x()) + static_cast<int>(m.pixel.y());
    return Eigen::Vector2d{cell % 5 == 0 ? 8.0 : 0.0, cell % 7 == 0 ? -8.0 : 0.0};
  });
  EXPECT_EQ(wrong.refusal(false).reason, Reason::kExcess);
}

TEST(Soundness, FewMeasurementsShowNoField) {
  SceneOptions options;
  options.poses = 3, options.points = 12, options.observations = 2;
  EXPECT_EQ(adjusted(options, rolling_shutter).field_px, 0.0);
}

TEST(Soundness, WhatHeldBeforeMayWaver) {
  const Soundness between{.field_px = 0.18};
  EXPECT_EQ(between.refusal(false).reason, Reason::kField);
  EXPECT_EQ(between.refusal(true).reason, Reason::kNone);
}

TEST(Soundness, ResidualsOfAPixelAreNoLandmarksAnyMore) {
  EXPECT_EQ((Soundness{.noise_px = 1.2}).refusal(true).reason, Reason::kNoise);
}

// One near point whose residuals are small, and many far ones that move by themselves.
TEST(Soundness, MeanChiSquareHasTheWeightsOfTheAdjustment) {
  const BundleScene scene(SceneOptions{});
  BundleProblem p;
  p.rig = &scene.rig;
  p.poses.push_back({SE3{}, true});
  EXPECT_EQ(soundness_of(p).mean_chi2, 0.0);
  const auto add = [&p](double weight, int measurements, double chi2) {
    BundleProblem::Point point;
    point.first_measurement = static_cast<int>(p.measurements.size());
    point.measurements = measurements;
    point.weight = weight;
    p.points.push_back(point);
    BundleProblem::Measurement m;
    m.chi2 = chi2;
    p.measurements.insert(p.measurements.end(), static_cast<std::size_t>(measurements), m);
  };
  add(1.0, 10, 0.5);
  EXPECT_DOUBLE_EQ(soundness_of(p).mean_chi2, 0.5);
  add(0.1, 100, 2.0);
  EXPECT_NEAR(soundness_of(p).mean_chi2, (10 * 0.5 + 0.1 * 100 * 2.0) / 20.0, 1e-12);
  // A measurement that does not project counts as the largest that is taken.
  add(1.0, 20, std::numeric_limits<double>::infinity());
  EXPECT_NEAR(soundness_of(p).mean_chi2, (10 * 0.5 + 0.1 * 100 * 2.0 + 20 * kLargestChi2) / 40.0, 1e-12);
}

// A second camera that swings on its mount: its own field shows it, and the map is judged by the first
// camera.
TEST(Soundness, AFurtherCameraThatMovesIsToldApart) {
  SceneOptions options;
  options.cameras = 2;
  BundleScene scene(options);
  BundleProblem& p = scene.start;
  BundleOptions solver;
  solver.iterations = 20;
  for (auto& m : p.measurements)
    if (m.camera == 1) m.pixel.x() += m.pose % 2 == 0 ? 1.0 : -1.0, m.sigma_px *= 20.0;
  ASSERT_TRUE(solve_schur(solver, &p).usable);
  for (auto& m : p.measurements)
    if (m.camera == 1) m.sigma_px /= 20.0;
  evaluate_bundle(&p);
  for (auto& m : p.measurements)
    if (m.camera == 1) m.chi2 = 0.0;  // all are inliers
  const Soundness sound = soundness_of(p);
  EXPECT_EQ(sound.refusal(false).reason, Reason::kNone);
  EXPECT_LT(sound.field_px, 0.1);
  EXPECT_NEAR(sound.further_field_px, 1.0, 0.2);
  EXPECT_GT(sound.further_measurements, 30.0);
}

}  // namespace
}  // namespace farpoint::slam
