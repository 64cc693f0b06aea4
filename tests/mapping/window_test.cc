// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/window.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "slam/solver/schur_solver.h"
#include "tests/support/point_world.h"

namespace farpoint::slam {
namespace {

using test::MappedWorld;

EstimatorConfig config_of(int window_keyframes, int fixed_keyframes = 40) {
  EstimatorConfig config = test::small_config();
  config.mapping.window_keyframes = window_keyframes;
  config.mapping.fixed_keyframes = fixed_keyframes;
  return config;
}

// Six keyframes: the later a keyframe, the more it shares with the last.
struct Drive {
  explicit Drive(const EstimatorConfig& config = config_of(3)) : w(config), k(w.add_keyframes(6)) {
    for (std::size_t i = 0; i + 1 < k.size(); ++i) {
      const std::vector<KeyframeHandle> observers(k.begin() + static_cast<std::ptrdiff_t>(i), k.end());
      const auto from = static_cast<std::uint32_t>(40 * i);
      w.add_landmarks(from, from + 40, observers);
    }
    w.update_covisibility(k);
  }
  [[nodiscard]] bool is_free(const Window& window, KeyframeHandle h) const {
    const auto& free = window.keyframes();
    return std::find(free.begin(), free.end(), h) != free.end();
  }
  MappedWorld w;
  std::vector<KeyframeHandle> k;
};

std::vector<SE3> poses_of(const Map& map) {
  std::vector<SE3> out;
  map.keyframes().for_each([&](KeyframeHandle, const Keyframe& k) { out.push_back(k.T_world_body); });
  return out;
}

bool same(const SE3& a, const SE3& b) {
  return a.q.coeffs() == b.q.coeffs() && a.t == b.t;
}

TEST(Window, FreesTheCentreAndItsMostCovisibleKeyframesUpToTheLimit) {
  Drive d;
  Window window(d.w.config, &d.w.map, &d.w.counts);
  window.build(d.k[5]);
  EXPECT_EQ(window.keyframes(), (std::vector<KeyframeHandle>{d.k[5], d.k[4], d.k[3]}));
  const auto& poses = window.problem().poses;
  ASSERT_EQ(poses.size(), 6U);
  for (std::size_t i = 0; i < poses.size(); ++i) EXPECT_EQ(poses[i].fixed, i >= 3) << i;
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_TRUE(same(poses[i].T_world_body, d.w.map.keyframes()[window.keyframes()[i]].T_world_body));
}

TEST(Window, FixesTheObserversThatSeeMostUpToTheLimit) {
  Drive d(config_of(3, 2));
  Window window(d.w.config, &d.w.map, &d.w.counts);
  window.build(d.k[5]);
  const auto& poses = window.problem().poses;
  ASSERT_EQ(poses.size(), 5U);
  EXPECT_TRUE(poses[3].fixed);
  EXPECT_TRUE(poses[4].fixed);
  // A landmark whose host is neither free nor fixed is not in the problem.
  for (const LandmarkHandle& h : window.landmarks()) {
    const SE3& host = d.w.map.keyframes()[d.w.map.landmarks()[h].host].T_world_body;
    EXPECT_TRUE(std::any_of(poses.begin(), poses.end(),
                            [&](const BundleProblem::Pose& p) { return same(p.T_world_body, host); }));
  }
}

TEST(Window, YoungMapFixesItsOldestKeyframeOnly) {
  MappedWorld w;
  const auto k = w.add_keyframes(3);
  w.add_landmarks(0, 100, k);
  w.update_covisibility(k);
  Window window(w.config, &w.map, &w.counts);
  window.build(k[1]);
  ASSERT_EQ(window.problem().poses.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_EQ(window.problem().poses[i].fixed, window.keyframes()[i] == k[0]) << i;
}

TEST(Window, MeasurementsAreTheSightingsThatHaveAnError) {
  Drive d;
  Window window(d.w.config, &d.w.map, &d.w.counts);
  window.build(d.k[5]);
  const BundleProblem& p = window.problem();
  ASSERT_GT(p.points.size(), 50U);
  ASSERT_EQ(p.points.size(), window.landmarks().size());
  std::set<std::uint32_t> slots;
  for (std::size_t i = 0; i < p.points.size(); ++i) {
    EXPECT_TRUE(slots.insert(window.landmarks()[i].index).second) << "twice";
    const Landmark& l = d.w.map.landmarks()[window.landmarks()[i]];
    EXPECT_EQ(p.points[i].inverse_depth, l.inverse_depth);
    EXPECT_TRUE(same(p.poses[static_cast<std::size_t>(p.points[i].host)].T_world_body,
                     d.w.map.keyframes()[l.host].T_world_body));
    // The host's own sighting has none.
    ASSERT_EQ(static_cast<std::size_t>(p.points[i].measurements), l.observations.size() - 1);
    for (int j = 0; j < p.points[i].measurements; ++j) {
      const auto& m = p.measurements[static_cast<std::size_t>(p.points[i].first_measurement + j)];
      const Observation& o = l.observations[static_cast<std::size_t>(j) + 1];
      EXPECT_EQ(m.pixel.cast<float>(), o.pixel);
      EXPECT_TRUE(same(p.poses[static_cast<std::size_t>(m.pose)].T_world_body,
                       d.w.map.keyframes()[o.keyframe].T_world_body));
      Eigen::Vector2d r;
      ASSERT_TRUE(residual(p, p.points[i], m, &r));
      EXPECT_LT(r.norm(), 1e-3);
    }
    EXPECT_GT(p.points[i].weight, 0.0);
    EXPECT_LT(p.points[i].weight, 1.0);
  }
}

TEST(Window, VirtualPointsStayOutside) {
  Drive d;
  const LandmarkHandle virtual_point = d.w.map.keyframes()[d.k[5]].views[0].landmarks[0];
  ASSERT_TRUE(d.w.map.landmarks().contains(virtual_point));
  d.w.map.landmarks()[virtual_point].state = LandmarkState::kBearing;
  Window window(d.w.config, &d.w.map, &d.w.counts);
  window.build(d.k[5]);
  EXPECT_EQ(std::count(window.landmarks().begin(), window.landmarks().end(), virtual_point), 0);
}

TEST(Window, StaysWithinItsLandmarksAndSightings) {
  EstimatorConfig config = config_of(3);
  config.mapping.window_landmarks = 12;
  Drive few(config);
  Window window(config, &few.w.map, &few.w.counts);
  window.build(few.k[5]);
  EXPECT_EQ(window.problem().points.size(), 12U);
  config.mapping.window_landmarks = 1000;
  config.mapping.window_sightings = 20;
  Drive seldom(config);
  Window small(config, &seldom.w.map, &seldom.w.counts);
  small.build(seldom.k[5]);
  EXPECT_LE(small.problem().measurements.size(), 20U);
  EXPECT_GT(small.problem().measurements.size(), 10U);
}

TEST(Window, TakesBackFreePosesDepthsAndSigmas) {
  Drive d;
  const std::vector<SE3> before = poses_of(d.w.map);
  Window window(d.w.config, &d.w.map, &d.w.counts);
  window.build(d.k[5]);
  BundleProblem& p = window.problem();
  std::vector<double> depths;
  for (const LandmarkHandle& h : window.landmarks()) depths.push_back(d.w.map.landmarks()[h].inverse_depth);
  for (auto& pose : p.poses) pose.T_world_body.t.x() += 0.5;
  for (auto& point : p.points) point.inverse_depth *= 1.1, point.inverse_depth_sigma = 0.25;
  const std::optional<double> change = window.take_back();
  ASSERT_TRUE(change);
  EXPECT_NEAR(*change, 1.1, 1e-12);
  const std::vector<SE3> after = poses_of(d.w.map);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(after[i].t.x() - before[i].t.x(), i >= 3 ? 0.5 : 0.0) << i;
    EXPECT_EQ(d.w.map.keyframes()[d.k[i]].optimised, i >= 3 ? 1U : 0U);
  }
  for (std::size_t i = 0; i < depths.size(); ++i) {
    const Landmark& l = d.w.map.landmarks()[window.landmarks()[i]];
    EXPECT_EQ(l.inverse_depth, depths[i] * 1.1);
    EXPECT_EQ(l.inverse_depth_sigma, 0.25);
  }
}

TEST(Window, GaugeKeyframeOfAYoungMapKeepsItsPose) {
  MappedWorld w;
  const auto k = w.add_keyframes(3);
  w.add_landmarks(0, 100, k);
  w.update_covisibility(k);
  Window window(w.config, &w.map, &w.counts);
  window.build(k[2]);
  for (auto& pose : window.problem().poses) pose.T_world_body.t.x() += 0.5;
  (void)window.take_back();
  EXPECT_EQ(w.map.keyframes()[k[0]].T_world_body.t.x(), test::PointWorld::pose(0).t.x());
  EXPECT_EQ(w.map.keyframes()[k[1]].T_world_body.t.x(), test::PointWorld::pose(1).t.x() + 0.5);
}

TEST(Window, RemovesTheOutlierSightingAndNoOther) {
  Drive d;
  Window window(d.w.config, &d.w.map, &d.w.counts);
  window.build(d.k[5]);
  BundleProblem& p = window.problem();
  const std::size_t at = 3;
  ASSERT_GE(p.points[at].measurements, 3);
  const LandmarkHandle h = window.landmarks()[at];
  const std::vector<Observation> before(d.w.map.landmarks()[h].observations.begin(),
                                        d.w.map.landmarks()[h].observations.end());
  p.measurements[static_cast<std::size_t>(p.points[at].first_measurement) + 1].chi2 = 6.0;
  p.measurements[static_cast<std::size_t>(p.points[at].first_measurement)].chi2 = 5.9;  // no outlier
  (void)window.take_back();
  const Landmark& l = d.w.map.landmarks()[h];
  ASSERT_EQ(l.observations.size(), before.size() - 1);
  // The first observation is the host's and no measurement.
  for (std::size_t i = 0; i < before.size(); ++i)
    EXPECT_EQ(Map::find_observation(l, before[i].keyframe) != nullptr, i != 2) << i;
  for (std::size_t i = 0; i < p.points.size(); ++i) {
    if (i == at) continue;
    EXPECT_EQ(d.w.map.landmarks()[window.landmarks()[i]].observations.size(),
              static_cast<std::size_t>(p.points[i].measurements) + 1);
  }
  EXPECT_EQ(d.w.counts.landmarks_culled, 0U);
}

TEST(Window, LandmarkOfOutliersGoesAndCalibrationIgnoresIt) {
  Drive d;
  Window window(d.w.config, &d.w.map, &d.w.counts);
  window.build(d.k[5]);
  BundleProblem& p = window.problem();
  for (int i = 0; i < p.points[0].measurements; ++i)
    p.measurements[static_cast<std::size_t>(p.points[0].first_measurement + i)].chi2 = 100.0;
  (void)window.take_back();
  EXPECT_FALSE(d.w.map.landmarks().contains(window.landmarks()[0]));
  EXPECT_EQ(d.w.counts.landmarks_culled, 1U);
  const auto d_bearing = window.bearing_derivatives(0);
  ASSERT_EQ(d_bearing.size(), p.points.size());
  EXPECT_EQ(p.points[0].measurements, 0);
  EXPECT_GT(p.points[1].measurements, 0);
  EXPECT_EQ(d_bearing[1], d.w.map.landmarks()[window.landmarks()[1]].d_bearing_d_pixel);
}

TEST(Window, SolvedWindowPutsTheMapRight) {
  Drive d;
  for (std::size_t i = 3; i < 6; ++i) {
    Vector6d delta;
    delta << 0.05, -0.04, 0.03, 0.004, -0.003, 0.002;
    SE3& pose = d.w.map.keyframes()[d.k[i]].T_world_body;
    pose = pose.boxplus(delta);
  }
  Window window(d.w.config, &d.w.map, &d.w.counts);
  window.build(d.k[5]);
  BundleOptions options;
  options.iterations = 20;
  options.relative_decrease = 1e-9;
  ASSERT_TRUE(solve_schur(options, &window.problem()).usable);
  ASSERT_TRUE(window.take_back());
  for (std::size_t i = 0; i < 6; ++i) {
    const Vector6d off =
        d.w.map.keyframes()[d.k[i]].T_world_body.boxminus_to(test::PointWorld::pose(static_cast<int>(i)));
    EXPECT_LT(off.norm(), 1e-3) << i;
  }
  EXPECT_EQ(d.w.counts.landmarks_culled, 0U);
}

}  // namespace
}  // namespace farpoint::slam
