// SPDX-License-Identifier: Apache-2.0
// Triangulation: exact, noisy with the predicted sigma, nearly parallel rays, refusals.
#include "slam/geometry/triangulation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "tests/geometry/random_geometry.h"

namespace farpoint::slam {
namespace {

using testing::direction;
using testing::gauss3;
using testing::noisy;
using testing::random_pose;
using testing::Rng;
using testing::uniform;

TEST(ParallaxAngle, IsExactNearZeroAndNearPi) {
  const double pi = std::numbers::pi;
  Rng rng(1);
  for (const double angle : {0.0, 1e-12, 1e-9, 1e-6, 1e-3, 0.5, 0.5 * pi, 3.0, pi - 1e-6, pi - 1e-9}) {
    const Eigen::Vector3d a = direction(rng), axis = a.unitOrthogonal();
    const Eigen::Vector3d b = std::cos(angle) * a + std::sin(angle) * axis.cross(a);
    EXPECT_NEAR(parallax_angle(3.0 * a, 0.1 * b), angle, 4e-16 * (1.0 + angle));
  }
}

struct Pair {
  Eigen::Vector3d bearing_host, bearing_target;
  SE3 T_target_host;
  double inverse_depth;
};

Pair random_pair(Rng& rng, double min_depth, double max_depth) {
  Pair pair;
  pair.T_target_host = random_pose(rng, 1.0, 2.0);
  pair.bearing_host = direction(rng);
  pair.inverse_depth = 1.0 / uniform(rng, min_depth, max_depth);
  pair.bearing_target = (pair.T_target_host * (pair.bearing_host / pair.inverse_depth)).normalized();
  return pair;
}

TEST(InverseDepth, IsExactForExactRays) {
  Rng rng(2);
  for (int i = 0; i < 2000; ++i) {
    const Pair p = random_pair(rng, 3.0, 200.0);
    const double sine =
        p.bearing_host.cross((p.T_target_host.q.conjugate() * p.T_target_host.t).normalized()).norm();
    if (sine < 0.05 || p.T_target_host.t.norm() < 0.05) continue;
    const InverseDepth d = triangulate_inverse_depth(p.bearing_host, p.T_target_host, p.bearing_target);
    EXPECT_TRUE(d.ok);
    EXPECT_NEAR(d.inverse_depth, p.inverse_depth, 1e-12);
    EXPECT_NEAR(d.parallax_rad, parallax_angle(p.T_target_host.q * p.bearing_host, p.bearing_target), 1e-15);
  }
}

TEST(InverseDepth, StaysExactAtParallaxesOfAMicroradian) {
  // 1 m baseline across the ray, 1000 km away.
  const SE3 T = {so3_exp({0.01, 0.2, -0.03}), {-1.0, 0.0, 0.0}};
  const Eigen::Vector3d host = T.q.conjugate() * Eigen::Vector3d(0.1, -0.05, 1.0).normalized();
  const Eigen::Vector3d target = (T * (1e6 * host)).normalized();
  const InverseDepth d = triangulate_inverse_depth(host, T, target);
  EXPECT_TRUE(d.ok);
  EXPECT_NEAR(d.inverse_depth, 1e-6, 1e-15);
  EXPECT_NEAR(d.parallax_rad, 1e-6, 2e-8);
}

TEST(InverseDepth, ZeroIsAPointAtInfinityAndNegativeIsNotOk) {
  const SE3 T = {Eigen::Quaterniond::Identity(), {-1.0, 0.0, 0.0}};
  const InverseDepth infinity = triangulate_inverse_depth({0, 0, 1}, T, {0, 0, 1});
  EXPECT_TRUE(infinity.ok);
  EXPECT_EQ(infinity.inverse_depth, 0.0);
  EXPECT_EQ(infinity.parallax_rad, 0.0);
  // Rays that part: the point would lie behind both. The signed solution is kept.
  const InverseDepth behind =
      triangulate_inverse_depth({0, 0, 1}, T, Eigen::Vector3d(0.01, 0, 1).normalized());
  EXPECT_FALSE(behind.ok);
  EXPECT_NEAR(behind.inverse_depth, -0.01, 1e-12);
  // The line through both rays meets at a positive depth of the host, but behind the target.
  const InverseDepth wrong_way =
      triangulate_inverse_depth({0, 0, 1}, T, -Eigen::Vector3d(-0.5, 0, 1).normalized());
  EXPECT_FALSE(wrong_way.ok);
}

TEST(InverseDepth, RefusesRaysWithoutDepth) {
  const SE3 still = {so3_exp({0.1, 0, 0}), Eigen::Vector3d::Zero()};
  EXPECT_FALSE(triangulate_inverse_depth({0, 0, 1}, still, {0, 0, 1}).ok);
  const SE3 forward = {Eigen::Quaterniond::Identity(), {0, 0, -1}};
  const InverseDepth along = triangulate_inverse_depth({0, 0, 1}, forward, {0, 0, 1});
  EXPECT_FALSE(along.ok);
  EXPECT_EQ(along.inverse_depth, 0.0);
  EXPECT_EQ(inverse_depth_sigma({0, 0, 1}, still, 0.1, 1e-3), std::numeric_limits<double>::infinity());
  EXPECT_EQ(inverse_depth_sigma({0, 0, 1}, forward, 0.1, 1e-3), std::numeric_limits<double>::infinity());
}

TEST(InverseDepth, MinimisesTheAngleInTheTarget) {
  Rng rng(3);
  for (int i = 0; i < 300; ++i) {
    const Pair p = random_pair(rng, 2.0, 20.0);
    const Eigen::Vector3d measured = noisy(rng, p.bearing_target, 0.01);
    const InverseDepth d = triangulate_inverse_depth(p.bearing_host, p.T_target_host, measured);
    if (!d.ok) continue;
    const auto angle = [&](double rho) {
      return parallax_angle(p.T_target_host.q * p.bearing_host + rho * p.T_target_host.t, measured);
    };
    EXPECT_LE(angle(d.inverse_depth), angle(d.inverse_depth + 1e-4) + 1e-15);
    EXPECT_LE(angle(d.inverse_depth), angle(d.inverse_depth - 1e-4) + 1e-15);
  }
}

// Normalised errors of 20000 trials have a standard deviation of 1 within 2 % (four times its own sigma of
// 0.5 %).
TEST(InverseDepthSigma, IsTheSpreadOfNoisyTriangulations) {
  Rng rng(4);
  for (int k = 0; k < 12; ++k) {
    Pair p;
    double sine = 0.0;
    do {
      p = random_pair(rng, 3.0, 60.0);
      sine = p.bearing_host.cross((p.T_target_host.q.conjugate() * p.T_target_host.t).normalized()).norm();
    } while (sine < 0.2 || p.T_target_host.t.norm() < 0.3);
    const double sigma_target = 3e-4, sigma_host = k % 2 == 0 ? 0.0 : 5e-4;
    const double sigma =
        inverse_depth_sigma(p.bearing_host, p.T_target_host, p.inverse_depth, sigma_target, sigma_host);
    double sum = 0.0, sum2 = 0.0;
    constexpr int kTrials = 20000;
    for (int i = 0; i < kTrials; ++i) {
      const InverseDepth d =
          triangulate_inverse_depth(noisy(rng, p.bearing_host, sigma_host), p.T_target_host,
                                    noisy(rng, p.bearing_target, sigma_target));
      const double error = (d.inverse_depth - p.inverse_depth) / sigma;
      sum += error;
      sum2 += error * error;
    }
    EXPECT_NEAR(sum / kTrials, 0.0, 0.035) << k;
    EXPECT_NEAR(std::sqrt(sum2 / kTrials), 1.0, 0.02) << k;
  }
}

TEST(InverseDepthSigma, AgreesWithTheFiguresOfTheMethod) {
  // METHOD.md: 1 px in each view at f = 458: depth sigma about 16 % at 1.146 degrees (its rounding: 15.4), 50
  // % at 0.36.
  const double sigma_rad = 1.0 / 458.0;
  for (const auto& [degrees, relative] : {std::pair{1.146, 0.154}, std::pair{0.36, 0.49}}) {
    const double depth = 1.0 / std::tan(degrees / 57.29578);
    const SE3 T = {Eigen::Quaterniond::Identity(), {-1.0, 0.0, 0.0}};
    const double sigma = inverse_depth_sigma({0, 0, 1}, T, 1.0 / depth, sigma_rad, sigma_rad);
    EXPECT_NEAR(sigma * depth, relative, 0.005);
  }
}

struct Rays {
  std::vector<Eigen::Vector3d> bearings_c;
  std::vector<SE3> T_camera_world;
};

Rays look_at(Rng& rng, const Eigen::Vector3d& point_w, const Eigen::Vector3d& near_w, size_t n,
             double sigma_rad) {
  Rays rays;
  for (size_t i = 0; i < n; ++i) {
    const SE3 pose = {so3_exp(direction(rng) * uniform(rng, 0.0, 3.0)), Eigen::Vector3d::Zero()};
    const Eigen::Vector3d centre_w = near_w + gauss3(rng);
    rays.T_camera_world.push_back({pose.q, -(pose.q * centre_w)});
    rays.bearings_c.push_back(noisy(rng, (rays.T_camera_world.back() * point_w).normalized(), sigma_rad));
  }
  return rays;
}

TEST(Dlt, IsExactForExactRaysFarFromTheOriginToo) {
  Rng rng(5);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d near_w = i % 2 == 0 ? Eigen::Vector3d::Zero() : Eigen::Vector3d(5000, -3000, 100);
    const Eigen::Vector3d point_w = near_w + direction(rng) * uniform(rng, 5.0, 100.0);
    const Rays rays = look_at(rng, point_w, near_w, 2 + static_cast<size_t>(i) % 6, 0.0);
    const TriangulatedPoint p = triangulate_dlt(rays.bearings_c, rays.T_camera_world);
    ASSERT_TRUE(p.ok) << i;
    // The worst pairs of a few thousand have hardly any baseline; rounding of 5 km counts as well.
    EXPECT_LT((p.point_w - point_w).norm(), 1e-6) << i;
  }
}

TEST(Dlt, GainsFromMoreRays) {
  Rng rng(6);
  const Eigen::Vector3d point_w(2.0, -1.0, 12.0);
  double error2 = 0.0, error20 = 0.0;
  for (int i = 0; i < 400; ++i) {
    const Rays rays = look_at(rng, point_w, Eigen::Vector3d::Zero(), 20, 1e-3);
    const TriangulatedPoint all = triangulate_dlt(rays.bearings_c, rays.T_camera_world);
    const TriangulatedPoint two = triangulate_dlt(std::span(rays.bearings_c).first(2), rays.T_camera_world);
    ASSERT_TRUE(all.ok);
    error20 += std::min(1.0, (all.point_w - point_w).norm()) / 400;
    error2 += std::min(1.0, (two.point_w - point_w).norm()) / 400;
  }
  EXPECT_LT(error20, 0.06);
  EXPECT_GT(error2, 2.0 * error20);
}

TEST(Dlt, RefusesWhatFixesNoPoint) {
  Rng rng(7);
  const Rays rays = look_at(rng, {0, 0, 10}, Eigen::Vector3d::Zero(), 3, 0.0);
  EXPECT_FALSE(triangulate_dlt(std::span(rays.bearings_c).first(1), rays.T_camera_world).ok);
  // One centre.
  const std::vector<SE3> same(2, rays.T_camera_world[0]);
  const std::vector<Eigen::Vector3d> bearings(2, rays.bearings_c[0]);
  EXPECT_FALSE(triangulate_dlt(bearings, same).ok);
  // All along the baseline: any depth fits.
  const std::vector<SE3> forward = {{}, {Eigen::Quaterniond::Identity(), {0, 0, -1}}};
  const std::vector<Eigen::Vector3d> ahead(2, Eigen::Vector3d::UnitZ());
  EXPECT_FALSE(triangulate_dlt(ahead, forward).ok);
  // Behind one camera: a bearing turned round is the same line, but not the same ray.
  std::vector<Eigen::Vector3d> turned = rays.bearings_c;
  turned[1] = -turned[1];
  EXPECT_FALSE(triangulate_dlt(turned, rays.T_camera_world).ok);
}

}  // namespace
}  // namespace farpoint::slam
