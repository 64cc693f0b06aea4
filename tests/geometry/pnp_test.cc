// SPDX-License-Identifier: Apache-2.0
// Pose from bearings and points.
#include "slam/geometry/pnp.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/geometry/random_geometry.h"

namespace farpoint::slam {
namespace {

using testing::direction;
using testing::noisy;
using testing::random_pose;
using testing::Rng;
using testing::uniform;

struct Matches {
  SE3 T_camera_world;
  std::vector<Eigen::Vector3d> bearings_c, points_w;
  std::vector<uint8_t> right;
};

// Points before the camera within 60 degrees of its axis, 3 to 40 units away; the world's origin far_away
// off.
Matches make_matches(Rng& rng, size_t n, double sigma_rad, double wrong_share, double far_away = 0.0) {
  Matches m;
  m.T_camera_world = random_pose(rng, 3.0, 20.0);
  m.T_camera_world.t += m.T_camera_world.q * Eigen::Vector3d(far_away, -far_away, 0.0);
  const SE3 T_world_camera = m.T_camera_world.inverse();
  const auto bearing = [&] {
    Eigen::Vector3d b;
    do b = direction(rng);
    while (b.z() < 0.5);
    return b;
  };
  while (m.bearings_c.size() < n) {
    const Eigen::Vector3d b = bearing();
    const bool wrong = uniform(rng, 0, 1) < wrong_share;
    m.points_w.push_back(T_world_camera * Eigen::Vector3d(b * uniform(rng, 3.0, 40.0)));
    m.bearings_c.push_back(noisy(rng, wrong ? bearing() : b, sigma_rad));
    m.right.push_back(wrong ? 0 : 1);
  }
  return m;
}

TEST(P3p, HasTheTruePoseAmongItsSolutionsAndAllFitTheRays) {
  Rng rng(1);
  int missed = 0;
  for (int k = 0; k < 2000; ++k) {
    const Matches m = make_matches(rng, 3, 0.0, 0.0);
    const PoseCandidates found = solve_p3p(std::span<const Eigen::Vector3d, 3>(m.bearings_c.data(), 3),
                                           std::span<const Eigen::Vector3d, 3>(m.points_w.data(), 3));
    double best = 1e9;
    for (size_t i = 0; i < found.count; ++i) {
      best = std::min(best, m.T_camera_world.boxminus_to(found.T_camera_world[i]).norm());
      for (size_t p = 0; p < 3; ++p) {
        const Eigen::Vector3d ray = (found.T_camera_world[i] * m.points_w[p]).normalized();
        EXPECT_LT((ray - m.bearings_c[p]).norm(), 1e-5) << k;
      }
    }
    missed += best < 1e-4 ? 0 : 1;
  }
  // Near a double root the three points fix the pose badly, whatever the solver: less than 1 %.
  EXPECT_LE(missed, 20);
}

TEST(P3p, RefusesPointsOnALine) {
  const std::array<Eigen::Vector3d, 3> points = {Eigen::Vector3d(0, 0, 5), Eigen::Vector3d(1, 0, 5),
                                                 Eigen::Vector3d(2, 0, 5)};
  std::array<Eigen::Vector3d, 3> bearings;
  std::transform(points.begin(), points.end(), bearings.begin(),
                 [](const Eigen::Vector3d& p) { return p.normalized(); });
  EXPECT_EQ(solve_p3p(bearings, points).count, 0U);
}

TEST(Pnp, IsExactWithoutNoise) {
  Rng rng(2);
  for (int k = 0; k < 50; ++k) {
    const Matches m = make_matches(rng, 40, 0.0, 0.0);
    const PnpResult r = solve_pnp(m.bearings_c, m.points_w, 1e-3);
    ASSERT_TRUE(r.ok);
    EXPECT_EQ(r.inliers, 40U);
    EXPECT_LT(m.T_camera_world.boxminus_to(r.T_camera_world).norm(), 1e-7);
  }
}

TEST(Pnp, FindsThePoseAmongFiftyPercentWrongMatches) {
  Rng rng(3);
  const double sigma = 1.0 / 458.0;
  for (int k = 0; k < 40; ++k) {
    // Every other time 10 km from the world's origin.
    const Matches m = make_matches(rng, 200, sigma, 0.5, k % 2 == 0 ? 0.0 : 7000.0);
    const PnpResult r = solve_pnp(m.bearings_c, m.points_w, sigma);
    ASSERT_TRUE(r.ok) << k;
    const SE3 truth_w = m.T_camera_world.inverse(), found_w = r.T_camera_world.inverse();
    // 100 right matches: about 2.2 mrad / sqrt(100) per axis, times the geometry's dilution.
    EXPECT_LT(so3_log(truth_w.q.conjugate() * found_w.q).norm(), 2.5e-3) << k;
    EXPECT_LT((truth_w.t - found_w.t).norm(), 0.03) << k;
    size_t right = 0, right_inliers = 0, wrong_inliers = 0;
    for (size_t i = 0; i < 200; ++i) {
      right += m.right[i];
      right_inliers += m.right[i] & r.inlier[i];
      wrong_inliers += static_cast<uint8_t>(1 - m.right[i]) & r.inlier[i];
    }
    EXPECT_GE(static_cast<double>(right_inliers), 0.94 * static_cast<double>(right)) << k;
    EXPECT_LE(wrong_inliers, 1U) << k;
    EXPECT_NEAR(r.rms_rad, sigma, 0.2 * sigma) << k;
  }
}

TEST(Pnp, SpreadIsWhatTheNoiseAllows) {
  // Normalised by the inverse of J^T J / sigma^2 at the truth, the squared error of six parameters
  // averages 6.
  Rng rng(4);
  const double sigma = 1e-3;
  double sum = 0.0;
  constexpr int kTrials = 200;
  for (int k = 0; k < kTrials; ++k) {
    const Matches m = make_matches(rng, 80, sigma, 0.0);
    const PnpResult r = solve_pnp(m.bearings_c, m.points_w, sigma);
    ASSERT_TRUE(r.ok);
    Matrix6d information = Matrix6d::Zero();
    for (const Eigen::Vector3d& p : m.points_w) {
      Eigen::Matrix<double, 3, 6> j;
      for (Eigen::Index c = 0; c < 6; ++c) {
        Vector6d step = Vector6d::Zero();
        step(c) = 1e-6;
        j.col(c) = ((m.T_camera_world.boxplus(step) * p).normalized() -
                    (m.T_camera_world.boxplus(-step) * p).normalized()) /
                   2e-6;
      }
      information += j.transpose() * j / (sigma * sigma);
    }
    const Vector6d error = m.T_camera_world.boxminus_to(r.T_camera_world);
    sum += error.dot(information * error);
  }
  EXPECT_GT(sum / kTrials, 5.0);
  EXPECT_LT(sum / kTrials, 7.5);
}

TEST(Pnp, RefusesWhatHasNoPose) {
  Rng rng(5);
  const Matches few = make_matches(rng, 3, 0.0, 0.0);
  EXPECT_FALSE(solve_pnp(few.bearings_c, few.points_w, 1e-3).ok);
  EXPECT_FALSE(solve_pnp({}, {}, 1e-3).ok);
  for (int k = 0; k < 5; ++k) {
    const Matches wrong = make_matches(rng, 150, 1e-3, 1.0);
    const PnpResult r = solve_pnp(wrong.bearings_c, wrong.points_w, 1e-3);
    EXPECT_FALSE(r.ok) << r.inliers;
  }
  const Matches m = make_matches(rng, 100, 1e-3, 0.5);
  PnpOptions strict;
  strict.min_inlier_share = 0.8;
  EXPECT_FALSE(solve_pnp(m.bearings_c, m.points_w, 1e-3, strict).ok);
}

// A pose needs ten inliers: of twenty matches that is a half, which few samples find.
TEST(Pnp, TriesNoMoreSamplesThanTheFewestInliersAskFor) {
  Rng rng(6);
  const Matches few = make_matches(rng, 20, 1e-3, 1.0), many = make_matches(rng, 150, 1e-3, 1.0);
  EXPECT_EQ(solve_pnp(few.bearings_c, few.points_w, 1e-3).samples, 52);  // ln 1e-3 / ln(1 - 1 / 8)
  EXPECT_EQ(solve_pnp(many.bearings_c, many.points_w, 1e-3).samples, PnpOptions{}.max_samples);
  int found = 0;
  for (int k = 0; k < 40; ++k) {
    const Matches m = make_matches(rng, 24, 1e-3, 0.4);
    found += solve_pnp(m.bearings_c, m.points_w, 1e-3).ok ? 1 : 0;
  }
  EXPECT_GE(found, 36);
}

TEST(Pnp, GivesTheSameBitsAgain) {
  Rng rng(6);
  const Matches m = make_matches(rng, 150, 2e-3, 0.4);
  const PnpResult a = solve_pnp(m.bearings_c, m.points_w, 2e-3),
                  b = solve_pnp(m.bearings_c, m.points_w, 2e-3);
  EXPECT_EQ(a.T_camera_world.q.coeffs(), b.T_camera_world.q.coeffs());
  EXPECT_EQ(a.T_camera_world.t, b.T_camera_world.t);
  EXPECT_EQ(a.inlier, b.inlier);
}

}  // namespace
}  // namespace farpoint::slam
