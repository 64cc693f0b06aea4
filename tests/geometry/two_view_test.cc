// SPDX-License-Identifier: Apache-2.0
// Automatic initialisation from two views over the scenes it meets: general, planar, rotating, driving, far,
// with wrong matches; exact and noisy.
#include "slam/geometry/two_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "slam/geometry/triangulation.h"
#include "tests/geometry/random_geometry.h"

namespace farpoint::slam {
namespace {

using testing::gauss;
using testing::Rng;
using testing::uniform;

struct Pinhole {
  double f_px;
  int width_px, height_px;
  [[nodiscard]] Eigen::Vector3d ray(double u_px, double v_px) const {
    return {(u_px - 0.5 * width_px) / f_px, (v_px - 0.5 * height_px) / f_px, 1.0};
  }
  [[nodiscard]] bool sees(const Eigen::Vector3d& p) const {
    return p.z() > 0.2 && std::abs(p.x() / p.z()) * f_px < 0.5 * width_px &&
           std::abs(p.y() / p.z()) * f_px < 0.5 * height_px;
  }
};
constexpr Pinhole kKitti{721, 1242, 375};
constexpr Pinhole kEuroc{458, 752, 480};

// A point in view 1, given its viewing ray (z = 1).
using Structure = std::function<Eigen::Vector3d(Rng&, const Eigen::Vector3d& ray)>;

// Evenly spread in inverse depth: every parallax up to the largest is as frequent.
Structure depths(double near_m, double far_m) {
  return [=](Rng& rng, const Eigen::Vector3d& ray) -> Eigen::Vector3d {
    return ray / uniform(rng, 1.0 / far_m, 1.0 / near_m);
  };
}
Structure plane(const Eigen::Vector3d& normal, double distance_m) {
  const Eigen::Vector3d n = normal.normalized();
  return [=](Rng&, const Eigen::Vector3d& ray) -> Eigen::Vector3d { return ray * (distance_m / n.dot(ray)); };
}
Structure mixed(const Structure& first, const Structure& second, double share_of_first) {
  return [=](Rng& rng, const Eigen::Vector3d& ray) -> Eigen::Vector3d {
    return uniform(rng, 0.0, 1.0) < share_of_first ? first(rng, ray) : second(rng, ray);
  };
}

struct Matches {
  std::vector<Eigen::Vector3d> b1, b2, points_1;
  std::vector<uint8_t> right;
};

Matches make_matches(uint64_t seed, const Pinhole& camera, const SE3& T_2_1, const Structure& structure,
                     size_t n, double sigma_px, double wrong_share) {
  Rng rng(seed);
  Matches m;
  const double sigma = sigma_px / camera.f_px;
  const auto pixel = [&] {
    const double u = uniform(rng, 0, camera.width_px), v = uniform(rng, 0, camera.height_px);
    return camera.ray(u, v);
  };
  const auto disturbed = [&](const Eigen::Vector3d& p) {
    const double du = sigma * gauss(rng), dv = sigma * gauss(rng);
    return Eigen::Vector3d(p.x() / p.z() + du, p.y() / p.z() + dv, 1.0).normalized();
  };
  while (m.b1.size() < n) {
    const Eigen::Vector3d p = structure(rng, pixel());
    const Eigen::Vector3d q = T_2_1 * p;
    if (!(p.z() > 0.2) || !camera.sees(q)) continue;
    const bool wrong = uniform(rng, 0.0, 1.0) < wrong_share;
    m.b1.push_back(disturbed(p));
    m.b2.push_back(disturbed(wrong ? pixel() : q));
    m.points_1.push_back(p);
    m.right.push_back(wrong ? 0 : 1);
  }
  return m;
}

struct Scene {
  const char* name;
  Pinhole camera;
  SE3 T_2_1;
  Structure structure;
  double max_rotation_deg, max_translation_deg;  // errors allowed at 1 px
};

double degrees(double rad) {
  return rad * 57.29577951308232;
}

void expect_good_structure(const Matches& m, const TwoViewResult& r, double baseline_m, double sigma_rad,
                           const SE3& T_2_1, size_t max_wrong) {
  size_t right_inliers = 0, right = 0, wrong_inliers = 0, close = 0, with_depth = 0;
  for (size_t i = 0; i < m.right.size(); ++i) {
    right += m.right[i];
    right_inliers += m.right[i] & r.inlier[i];
    wrong_inliers += static_cast<uint8_t>(1 - m.right[i]) & r.inlier[i];
    if (m.right[i] == 0 || r.inverse_depth[i] <= 0.0) continue;
    EXPECT_EQ(r.inlier[i], 1);
    ++with_depth;
    const double truth = baseline_m / m.points_1[i].norm();
    const SE3 unit = {T_2_1.q, T_2_1.t / baseline_m};
    const double sigma = inverse_depth_sigma(m.points_1[i].normalized(), unit, truth, sigma_rad, sigma_rad);
    close += std::abs(r.inverse_depth[i] - truth) < 5.0 * sigma + 0.05 * truth ? 1U : 0U;
  }
  EXPECT_GE(static_cast<double>(right_inliers), 0.93 * static_cast<double>(right));
  EXPECT_LE(wrong_inliers, max_wrong);
  EXPECT_GE(static_cast<double>(close), 0.95 * static_cast<double>(with_depth));
  EXPECT_GE(with_depth, right_inliers / 2);
}

std::vector<Scene> scenes_with_parallax() {
  return {
      {"general", kEuroc, {so3_exp({0.05, -0.08, 0.03}), {-0.25, 0.05, 0.02}}, depths(2, 8), 0.5, 2.5},
      {"small parallax", kEuroc, {so3_exp({0.02, -0.03, 0.03}), {-0.1, 0.02, 0.01}}, depths(2, 8), 0.5, 6.0},
      {"driving straight", kKitti, {so3_exp({0.001, 0.005, 0.0}), {0, 0, -1}}, depths(5, 80), 0.2, 1.5},
      {"driving a turn", kKitti, {so3_exp({0.001, 0.04, 0.0}), {0.02, 0, -0.8}}, depths(5, 80), 0.2, 1.8},
      {"road and fronts",
       kKitti,
       {so3_exp({0.001, 0.005, 0.0}), {0, 0, -1}},
       mixed(plane({0, 1, 0.001}, 1.6), depths(8, 60), 0.4),
       0.25,
       2.0},
      {"frontal wall",
       kEuroc,
       {so3_exp({0.02, -0.05, 0.01}), {-0.4, 0.05, 0.0}},
       plane({0, 0, 1}, 3),
       0.5,
       3.0},
      {"oblique wall",
       kEuroc,
       {so3_exp({0.02, -0.05, 0.01}), {-0.4, 0.05, 0.0}},
       plane({0.5, 0.1, 0.8}, 3),
       0.5,
       3.0},
      {"ground from a drone",
       kEuroc,
       {so3_exp({0.02, 0.05, 0.05}), {-3, 0.5, 0}},
       plane({0.05, 0.1, 1}, 30),
       0.5,
       3.0},
      {"near things before a far skyline",
       kKitti,
       {so3_exp({0.001, 0.005, 0.0}), {0.3, 0, -1}},
       mixed(depths(500, 5000), depths(5, 50), 0.6),
       0.2,
       2.5},
  };
}

class TwoViewScenes : public ::testing::TestWithParam<Scene> {};

TEST_P(TwoViewScenes, ExactMatches) {
  const Scene& s = GetParam();
  for (uint64_t seed = 0; seed < 5; ++seed) {
    const Matches m = make_matches(seed, s.camera, s.T_2_1, s.structure, 200, 0.0, 0.0);
    const double sigma = 0.5 / s.camera.f_px;
    const TwoViewResult r = estimate_two_view(m.b1, m.b2, sigma);
    ASSERT_EQ(r.status, TwoViewStatus::kOk) << name(r.status) << " seed " << seed;
    EXPECT_LT(degrees(so3_log(r.T_2_1.q.conjugate() * s.T_2_1.q).norm()), 1e-4);
    EXPECT_LT(degrees(parallax_angle(r.T_2_1.t, s.T_2_1.t)), 1e-3);
    EXPECT_NEAR(r.T_2_1.t.norm(), 1.0, 1e-12);
    EXPECT_EQ(r.inliers, 200U);
    for (size_t i = 0; i < 200; ++i) {
      if (r.inverse_depth[i] > 0.0) {
        EXPECT_NEAR(r.inverse_depth[i], s.T_2_1.t.norm() / m.points_1[i].norm(), 1e-5);
      }
    }
  }
}

TEST_P(TwoViewScenes, OnePixelOfNoise) {
  const Scene& s = GetParam();
  for (uint64_t seed = 0; seed < 8; ++seed) {
    const Matches m = make_matches(seed, s.camera, s.T_2_1, s.structure, 400, 1.0, 0.0);
    const double sigma = 1.0 / s.camera.f_px;
    const TwoViewResult r = estimate_two_view(m.b1, m.b2, sigma);
    ASSERT_EQ(r.status, TwoViewStatus::kOk) << name(r.status) << " seed " << seed;
    EXPECT_LT(degrees(so3_log(r.T_2_1.q.conjugate() * s.T_2_1.q).norm()), s.max_rotation_deg) << seed;
    EXPECT_LT(degrees(parallax_angle(r.T_2_1.t, s.T_2_1.t)), s.max_translation_deg) << seed;
    expect_good_structure(m, r, s.T_2_1.t.norm(), sigma, s.T_2_1, 0);
  }
}

TEST_P(TwoViewScenes, OnePixelOfNoiseAndThirtyPercentWrong) {
  const Scene& s = GetParam();
  for (uint64_t seed = 0; seed < 8; ++seed) {
    const Matches m = make_matches(100 + seed, s.camera, s.T_2_1, s.structure, 500, 1.0, 0.3);
    const double sigma = 1.0 / s.camera.f_px;
    const TwoViewResult r = estimate_two_view(m.b1, m.b2, sigma);
    ASSERT_EQ(r.status, TwoViewStatus::kOk) << name(r.status) << " seed " << seed;
    EXPECT_LT(degrees(so3_log(r.T_2_1.q.conjugate() * s.T_2_1.q).norm()), s.max_rotation_deg) << seed;
    EXPECT_LT(degrees(parallax_angle(r.T_2_1.t, s.T_2_1.t)), s.max_translation_deg) << seed;
    // Of 150 wrong matches a few lie on their epipolar line at a believable depth: 2 %.
    expect_good_structure(m, r, s.T_2_1.t.norm(), sigma, s.T_2_1, 4);
    EXPECT_GT(r.median_parallax_rad, 0.0);
  }
}

INSTANTIATE_TEST_SUITE_P(All, TwoViewScenes, ::testing::ValuesIn(scenes_with_parallax()),
                         [](const ::testing::TestParamInfo<Scene>& i) {
                           std::string text = i.param.name;
                           std::replace(text.begin(), text.end(), ' ', '_');
                           return text;
                         });

struct StillScene {
  const char* name;
  Pinhole camera;
  SE3 T_2_1;
  Structure structure;
};

class TwoViewWithoutParallax : public ::testing::TestWithParam<StillScene> {};

TEST_P(TwoViewWithoutParallax, SaysSo) {
  const StillScene& s = GetParam();
  for (const double sigma_px : {0.3, 1.0}) {
    for (const double wrong : {0.0, 0.3, 0.5}) {
      for (uint64_t seed = 0; seed < 4; ++seed) {
        const Matches m = make_matches(seed, s.camera, s.T_2_1, s.structure, 400, sigma_px, wrong);
        const TwoViewResult r = estimate_two_view(m.b1, m.b2, sigma_px / s.camera.f_px);
        ASSERT_EQ(r.status, TwoViewStatus::kNoParallax) << name(r.status) << " " << sigma_px << " " << wrong;
        EXPECT_LT(degrees(so3_log(r.T_2_1.q.conjugate() * s.T_2_1.q).norm()), 0.1);
        EXPECT_EQ(r.T_2_1.t.norm(), 0.0);
        EXPECT_EQ(
            std::count_if(r.inverse_depth.begin(), r.inverse_depth.end(), [](double d) { return d > 0.0; }),
            0);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, TwoViewWithoutParallax,
    ::testing::Values(
        StillScene{"rotation", kEuroc, {so3_exp({0.02, -0.15, 0.05}), {0, 0, 0}}, depths(2, 8)},
        StillScene{"no_motion", kEuroc, {}, depths(2, 8)},
        StillScene{"two_millimetres", kEuroc, {so3_exp({0.02, -0.15, 0.05}), {0.002, 0, 0}}, depths(4, 16)},
        StillScene{"far_points_only", kKitti, {so3_exp({0.001, 0.005, 0}), {0, 0, -1}}, depths(500, 5000)}),
    [](const ::testing::TestParamInfo<StillScene>& i) { return std::string(i.param.name); });

// Flying obliquely at a wall leaves two motions that both see the whole wall in front of them.
TEST(TwoView, SaysThatAPlaneSeenTwiceIsAmbiguous) {
  const SE3 T_2_1 = {so3_exp({0.02, -0.05, 0.01}), {-0.25, 0.05, -0.4}};
  for (uint64_t seed = 0; seed < 8; ++seed) {
    const Matches m = make_matches(seed, kEuroc, T_2_1, plane({0.3, 0.1, 0.9}, 3), 400, 0.5, 0.2);
    const TwoViewResult r = estimate_two_view(m.b1, m.b2, 0.5 / kEuroc.f_px);
    EXPECT_EQ(r.status, TwoViewStatus::kAmbiguous) << name(r.status) << " seed " << seed;
    EXPECT_LT(r.rival_sigmas, TwoViewOptions().ambiguity_sigmas);
  }
}

TEST(TwoView, IsSureAboutThatWallOnceSomethingStandsBeforeIt) {
  const SE3 T_2_1 = {so3_exp({0.02, -0.05, 0.01}), {-0.25, 0.05, -0.4}};
  for (uint64_t seed = 0; seed < 8; ++seed) {
    const Matches m = make_matches(seed, kEuroc, T_2_1,
                                   mixed(plane({0.3, 0.1, 0.9}, 3), depths(1.5, 2.5), 0.75), 400, 0.5, 0.2);
    const TwoViewResult r = estimate_two_view(m.b1, m.b2, 0.5 / kEuroc.f_px);
    ASSERT_EQ(r.status, TwoViewStatus::kOk) << name(r.status) << " seed " << seed;
    EXPECT_LT(degrees(parallax_angle(r.T_2_1.t, T_2_1.t)), 2.0);
  }
}

TEST(TwoView, ChoosesTheModelByTheScene) {
  const SE3 T_2_1 = {so3_exp({0.02, -0.05, 0.01}), {-0.4, 0.05, 0.0}};
  for (uint64_t seed = 0; seed < 8; ++seed) {
    const Matches wall = make_matches(seed, kEuroc, T_2_1, plane({0.5, 0.1, 0.8}, 3), 300, 1.0, 0.2);
    EXPECT_EQ(estimate_two_view(wall.b1, wall.b2, 1.0 / kEuroc.f_px).model, TwoViewModel::kHomography);
    const Matches room = make_matches(seed, kEuroc, T_2_1, depths(2, 8), 300, 1.0, 0.2);
    EXPECT_EQ(estimate_two_view(room.b1, room.b2, 1.0 / kEuroc.f_px).model, TwoViewModel::kEssential);
  }
}

TEST(TwoView, TakesBearingsBeyondNinetyDegrees) {
  Rng rng(1);
  const SE3 truth = {so3_exp({0.1, -0.2, 0.05}), {-0.5, 0.1, 0.2}};
  std::vector<Eigen::Vector3d> b1, b2;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d p = testing::direction(rng) * uniform(rng, 2.0, 10.0);
    b1.push_back(testing::noisy(rng, p.normalized(), 2e-3));
    b2.push_back(testing::noisy(rng, (truth * p).normalized(), 2e-3));
  }
  const TwoViewResult r = estimate_two_view(b1, b2, 2e-3);
  ASSERT_EQ(r.status, TwoViewStatus::kOk);
  EXPECT_LT(degrees(so3_log(r.T_2_1.q.conjugate() * truth.q).norm()), 0.1);
  EXPECT_LT(degrees(parallax_angle(r.T_2_1.t, truth.t)), 0.5);
}

TEST(TwoView, RefusesTooFewMatchesAndNoise) {
  const SE3 T_2_1 = {so3_exp({0.02, -0.05, 0.01}), {-0.4, 0.05, 0.0}};
  const Matches few = make_matches(1, kEuroc, T_2_1, depths(2, 8), 19, 0.0, 0.0);
  EXPECT_EQ(estimate_two_view(few.b1, few.b2, 1e-3).status, TwoViewStatus::kTooFewMatches);
  EXPECT_EQ(estimate_two_view({}, {}, 1e-3).status, TwoViewStatus::kTooFewMatches);
  for (uint64_t seed = 0; seed < 5; ++seed) {
    const Matches wrong = make_matches(seed, kEuroc, T_2_1, depths(2, 8), 300, 1.0, 1.0);
    const TwoViewResult r = estimate_two_view(wrong.b1, wrong.b2, 1.0 / kEuroc.f_px);
    EXPECT_EQ(r.status, TwoViewStatus::kPoorModel) << name(r.status);
  }
}

TEST(TwoView, GivesTheSameBitsAgain) {
  const SE3 T_2_1 = {so3_exp({0.02, -0.05, 0.01}), {-0.4, 0.05, 0.0}};
  const Matches m = make_matches(3, kEuroc, T_2_1, depths(2, 8), 333, 1.0, 0.4);
  const TwoViewResult a = estimate_two_view(m.b1, m.b2, 1.0 / kEuroc.f_px);
  // Elsewhere in memory.
  const std::vector<Eigen::Vector3d> padding(7), b1(m.b1), b2(m.b2);
  const TwoViewResult b = estimate_two_view(b1, b2, 1.0 / kEuroc.f_px);
  EXPECT_EQ(a.T_2_1.q.coeffs(), b.T_2_1.q.coeffs());
  EXPECT_EQ(a.T_2_1.t, b.T_2_1.t);
  EXPECT_EQ(a.inlier, b.inlier);
  EXPECT_EQ(a.inverse_depth, b.inverse_depth);
  EXPECT_EQ(a.rival_sigmas, b.rival_sigmas);
}

}  // namespace
}  // namespace farpoint::slam
