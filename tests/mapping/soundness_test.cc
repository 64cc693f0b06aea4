// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/soundness.h"

#include <gtest/gtest.h>

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

TEST(Soundness, CoherenceIsSmallForErrorsThatKnowNothingOfEachOther) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    SceneOptions options;
    options.seed = seed;
    const Soundness sound = adjusted(options, nowhere);
    // The adjustment has fitted some of the field itself.
    EXPECT_GT(sound.coherence, 0.5);
    EXPECT_LT(sound.coherence, 1.2);
    EXPECT_GT(sound.mean_chi2, 0.5);  // the measurements' errors are what their sigma says
    EXPECT_LT(sound.mean_chi2, 2.0);
  }
}

TEST(Soundness, CoherenceIsSmallWhateverTheWeights) {
  for (const std::uint64_t seed : {5U, 6U, 7U}) {
    SceneOptions options;
    options.seed = seed;
    options.least_weight = 0.002;
    const double coherence = adjusted(options, nowhere).coherence;
    EXPECT_GT(coherence, 0.5);
    EXPECT_LT(coherence, 1.3);
  }
}

TEST(Soundness, CoherenceDoesNotKnowHowLargeTheErrorsAre) {
  SceneOptions options;
  options.noise_px = 0.1;
  const double small = adjusted(options, nowhere).coherence;
  options.noise_px = 1.0;
  EXPECT_NEAR(adjusted(options, nowhere).coherence, small, 0.3);
}

TEST(Soundness, RollingShutterIsCoherent) {
  const Soundness bent = adjusted(SceneOptions{}, rolling_shutter);
  EXPECT_GT(bent.coherence, 5.0);
  EXPECT_GT(bent.pattern(), 3.0 * adjusted(SceneOptions{}, nowhere).pattern());
  // The residuals have hardly grown.
  EXPECT_LT(bent.mean_chi2, 1.5 * adjusted(SceneOptions{}, nowhere).mean_chi2);
}

TEST(Soundness, FewMeasurementsSayNothingOfCoherence) {
  SceneOptions options;
  options.poses = 3, options.points = 12, options.observations = 2;
  EXPECT_EQ(adjusted(options, rolling_shutter).coherence, 0.0);
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

}  // namespace
}  // namespace farpoint::slam
