// SPDX-License-Identifier: Apache-2.0
// The parts below two-view and PnP: roots, five points, homographies, rotations, epipolar residuals and
// refinement.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "slam/geometry/five_point.h"
#include "slam/geometry/polynomial.h"
#include "slam/geometry/random.h"
#include "slam/geometry/relative_motion.h"
#include "slam/geometry/triangulation.h"
#include "tests/geometry/random_geometry.h"

namespace farpoint::slam {
namespace {

using testing::direction;
using testing::gauss;
using testing::noisy;
using testing::random_pose;
using testing::Rng;
using testing::uniform;

std::vector<double> from_roots(const std::vector<double>& roots) {
  std::vector<double> c = {1.0};
  for (const double root : roots) {
    c.push_back(0.0);
    for (size_t i = c.size() - 1; i > 0; --i) c[i] = c[i - 1] - root * c[i];
    c[0] *= -root;
  }
  return c;
}

TEST(Polynomial, FindsAllRealRoots) {
  Rng rng(1);
  for (int k = 0; k < 500; ++k) {
    std::vector<double> roots;
    const size_t n = 1 + static_cast<size_t>(k) % 6;
    while (roots.size() < n) {
      const double root = std::exp(uniform(rng, -2.0, 2.0)) * (uniform(rng, 0, 1) < 0.5 ? -1 : 1);
      const bool close =
          std::any_of(roots.begin(), roots.end(), [&](double r) { return std::abs(r - root) < 0.05; });
      if (!close) roots.push_back(root);
    }
    std::vector<double> c = from_roots(roots);
    // Times x^2 + x + 1, which has no real root.
    c.resize(c.size() + 2, 0.0);
    for (size_t i = c.size(); i-- > 0;) c[i] += (i >= 1 ? c[i - 1] : 0.0) + (i >= 2 ? c[i - 2] : 0.0);
    RealRoots found = real_roots(c);
    std::sort(found.value.begin(), found.value.begin() + static_cast<std::ptrdiff_t>(found.count));
    std::sort(roots.begin(), roots.end());
    ASSERT_EQ(found.count, roots.size()) << k;
    for (size_t i = 0; i < n; ++i) EXPECT_NEAR(found.value[i], roots[i], 1e-8 * (1.0 + std::abs(roots[i])));
  }
}

TEST(Polynomial, KeepsToTheInterval) {
  const std::vector<double> c = from_roots({-2.0, 0.25, 0.5, 3.0});
  const RealRoots found = real_roots(c, 0.0, 1.0);
  ASSERT_EQ(found.count, 2U);
  EXPECT_NEAR(found.value[0], 0.25, 1e-14);
  EXPECT_NEAR(found.value[1], 0.5, 1e-14);
  EXPECT_EQ(real_roots(std::vector<double>{1.0, 0.0, 1.0}).count, 0U);
  EXPECT_EQ(real_roots(std::vector<double>{2.0}).count, 0U);
}

TEST(SampleGenerator, DrawsDifferentIndicesEvenlyAndRepeats) {
  SampleGenerator a(5), b(5);
  std::array<int, 10> hits{};
  for (int i = 0; i < 20000; ++i) {
    const auto sample = a.sample<5>(10);
    EXPECT_EQ(sample, b.sample<5>(10));
    for (size_t k = 0; k < 5; ++k) {
      ASSERT_LT(sample[k], 10U);
      ++hits[sample[k]];
      for (size_t n = 0; n < k; ++n) ASSERT_NE(sample[k], sample[n]);
    }
  }
  for (const int h : hits) EXPECT_NEAR(h, 10000, 400);
}

struct Scene {
  SE3 T_2_1;
  std::vector<Eigen::Vector3d> b1, b2;
};

// Points all around the cameras: bearings need no common half space.
Scene scene_all_around(Rng& rng, size_t n, double sigma_rad = 0.0) {
  Scene s;
  s.T_2_1 = random_pose(rng, 1.0, 1.0);
  s.T_2_1.t.normalize();
  for (size_t i = 0; i < n; ++i) {
    const Eigen::Vector3d p = direction(rng) * uniform(rng, 2.0, 8.0);
    s.b1.push_back(noisy(rng, p.normalized(), sigma_rad));
    s.b2.push_back(noisy(rng, (s.T_2_1 * p).normalized(), sigma_rad));
  }
  return s;
}

double distance_up_to_sign(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return std::min((a - b).norm(), (a + b).norm());
}

TEST(FivePoint, HasTheTrueMatrixAmongItsSolutionsAndAllSatisfyTheConstraints) {
  Rng rng(2);
  int missed = 0;
  for (int k = 0; k < 1000; ++k) {
    const Scene s = scene_all_around(rng, 5);
    const EssentialCandidates found = solve_five_point(std::span<const Eigen::Vector3d, 5>(s.b1.data(), 5),
                                                       std::span<const Eigen::Vector3d, 5>(s.b2.data(), 5));
    Eigen::Matrix3d truth = skew(s.T_2_1.t) * s.T_2_1.rotation();
    truth /= truth.norm();
    double best = 2.0;
    for (size_t i = 0; i < found.count; ++i) {
      const Eigen::Matrix3d& e = found.matrix[i];
      best = std::min(best, distance_up_to_sign(e, truth));
      for (size_t n = 0; n < 5; ++n) EXPECT_LT(std::abs(s.b2[n].dot(e * s.b1[n])), 1e-9);
      EXPECT_NEAR(e.norm(), 1.0, 1e-12);
    }
    missed += best < 1e-6 ? 0 : 1;
  }
  // A double root now and then is lost to rounding.
  EXPECT_LE(missed, 5);
}

TEST(Essential, DecomposesIntoFourMotionsOneOfThemTrue) {
  Rng rng(3);
  for (int k = 0; k < 200; ++k) {
    const SE3 truth = scene_all_around(rng, 0).T_2_1;
    const Eigen::Matrix3d e = -3.0 * skew(truth.t) * truth.rotation();
    double best = 9.0;
    for (const SE3& m : decompose_essential(e)) {
      EXPECT_NEAR(m.t.norm(), 1.0, 1e-12);
      EXPECT_LT(distance_up_to_sign(skew(m.t) * m.rotation(), e / 3.0), 1e-12);
      best = std::min(best, truth.boxminus_to(m).norm());
    }
    EXPECT_LT(best, 1e-7);
  }
}

// Mean and spread of chi-square over many noisy matches: 1 and 2, 2 and 4 for one and two degrees of freedom.
struct Moments {
  double sum = 0.0, sum2 = 0.0;
  int n = 0;
  void add(double x) { sum += x, sum2 += x * x, ++n; }
  [[nodiscard]] double mean() const { return sum / n; }
  [[nodiscard]] double variance() const { return sum2 / n - mean() * mean(); }
};

TEST(Residuals, AreChiSquareUnderTheirModels) {
  Rng rng(4);
  const double sigma = 1e-3, sigma2 = sigma * sigma;
  Moments epipolar, homography, rotation;
  for (int k = 0; k < 100; ++k) {
    const Scene s = scene_all_around(rng, 200, sigma);
    const Eigen::Vector3d normal = direction(rng);
    const Eigen::Matrix3d h = s.T_2_1.rotation() + 0.2 * s.T_2_1.t * normal.transpose();
    for (size_t i = 0; i < 200; ++i) {
      epipolar.add(epipolar_residual2_rad2(s.T_2_1, s.b1[i], s.b2[i]) / sigma2);
      const Eigen::Vector3d exact = direction(rng);
      const Eigen::Vector3d b1 = noisy(rng, exact, sigma);
      homography.add(homography_residual2_rad2(h, b1, noisy(rng, (h * exact).normalized(), sigma)) / sigma2);
      rotation.add(rotation_residual2_rad2(s.T_2_1.rotation(), b1, noisy(rng, s.T_2_1.q * exact, sigma)) /
                   sigma2);
    }
  }
  EXPECT_NEAR(epipolar.mean(), 1.0, 0.05);
  EXPECT_NEAR(epipolar.variance(), 2.0, 0.25);
  for (const Moments& m : {homography, rotation}) {
    EXPECT_NEAR(m.mean(), 2.0, 0.07);
    EXPECT_NEAR(m.variance(), 4.0, 0.4);
  }
}

TEST(Residuals, SeeOppositeBearingsUnderAHomography) {
  EXPECT_EQ(homography_residual2_rad2(Eigen::Matrix3d::Identity(), {0, 0, 1}, {0, 0, -1}),
            std::numeric_limits<double>::infinity());
}

TEST(RefineMotion, ReachesTheTruthFromAfarWithoutNoise) {
  Rng rng(5);
  for (int k = 0; k < 100; ++k) {
    const Scene s = scene_all_around(rng, 60);
    Vector6d off;
    off << 0.05 * direction(rng), 0.02 * direction(rng);
    SE3 start = s.T_2_1.boxplus(off);
    start.t.normalize();
    // The start is off by up to 70 mrad: a sigma of 20 mrad lets every match take part.
    const MotionFit fit = refine_motion(s.b1, s.b2, 0.02, start);
    EXPECT_LT(s.T_2_1.boxminus_to(fit.T_2_1).norm(), 1e-6) << k;
    EXPECT_EQ(fit.used, 60U);
  }
}

TEST(RefineMotion, KnowsTheSpreadOfItsTranslation) {
  Rng rng(6);
  const SE3 truth = {so3_exp({0.02, -0.05, 0.01}), Eigen::Vector3d(-1.0, 0.2, 0.1).normalized()};
  const double sigma = 1e-3;
  double worst = 0.0, predicted = 0.0;
  constexpr int kTrials = 300;
  for (int k = 0; k < kTrials; ++k) {
    std::vector<Eigen::Vector3d> b1, b2;
    for (int i = 0; i < 150; ++i) {
      const Eigen::Vector3d p =
          Eigen::Vector3d(uniform(rng, -0.8, 0.8), uniform(rng, -0.5, 0.5), 1.0) * uniform(rng, 4.0, 15.0);
      b1.push_back(noisy(rng, p.normalized(), sigma));
      b2.push_back(noisy(rng, (truth * p).normalized(), sigma));
    }
    const MotionFit fit = refine_motion(b1, b2, sigma, truth);
    worst += std::pow(parallax_angle(fit.T_2_1.t, truth.t), 2) / kTrials;
    predicted += std::pow(fit.translation_sigma_rad, 2) / kTrials;
  }
  // The angle's square holds the variance of both directions, the prediction is the larger one: a ratio of 1
  // to 2, and 5 % less for the Huber cost.
  EXPECT_GT(worst / predicted, 0.85);
  EXPECT_LT(worst / predicted, 2.2);
}

TEST(SupportedMatches, RejectsChanceHitsAmongWrongMatches) {
  Rng rng(7);
  const SE3 truth = {Eigen::Quaterniond::Identity(), {-1, 0, 0}};
  std::vector<Eigen::Vector3d> b1, b2;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d p =
        Eigen::Vector3d(uniform(rng, -0.6, 0.6), uniform(rng, -0.4, 0.4), 1.0) * uniform(rng, 20.0, 40.0);
    b1.push_back(p.normalized());
    b2.push_back((truth * p).normalized());
  }
  // Wrong matches all over the image, and one that lies exactly on its epipolar line, far along it.
  for (int i = 0; i < 60; ++i) {
    b1.push_back(Eigen::Vector3d(uniform(rng, -0.6, 0.6), uniform(rng, -0.4, 0.4), 1.0).normalized());
    b2.push_back(Eigen::Vector3d(uniform(rng, -0.6, 0.6), uniform(rng, -0.4, 0.4), 1.0).normalized());
  }
  b1.push_back(Eigen::Vector3d(0.5, 0.1, 1.0).normalized());
  b2.push_back(Eigen::Vector3d(-0.1, 0.1, 1.0).normalized());
  ASSERT_LT(epipolar_residual2_rad2(truth, b1.back(), b2.back()), 1e-20);
  const std::vector<uint8_t> mask = supported_matches(b1, b2, truth, 1e-3);
  EXPECT_EQ(std::count(mask.begin(), mask.begin() + 200, uint8_t{1}), 200);
  EXPECT_EQ(mask.back(), 0);
}

struct PlaneScene {
  SE3 T_2_1;
  Eigen::Vector3d normal_1;
  Eigen::Matrix3d h;
};

PlaneScene random_plane(Rng& rng) {
  PlaneScene s;
  s.T_2_1 = random_pose(rng, 0.8, 1.0);
  s.T_2_1.t.normalize();
  s.normal_1 = direction(rng);
  s.h = s.T_2_1.rotation() + uniform(rng, 0.05, 0.7) * s.T_2_1.t * s.normal_1.transpose();
  return s;
}

TEST(Homography, DecomposesIntoMotionsThatMakeItOneOfThemTrue) {
  Rng rng(8);
  for (int k = 0; k < 300; ++k) {
    const PlaneScene s = random_plane(rng);
    const PlaneMotions found = decompose_homography(2.5 * s.h);
    ASSERT_EQ(found.count, 4U);
    double best = 9.0;
    for (size_t i = 0; i < 4; ++i) {
      const PlaneMotion& m = found.motion[i];
      EXPECT_NEAR(m.T_2_1.t.norm(), 1.0, 1e-12);
      EXPECT_NEAR(m.normal_1.norm(), 1.0, 1e-12);
      // H - R is t n^T times a positive factor: the distance of the plane in baselines.
      const Eigen::Matrix3d rest = s.h - m.T_2_1.rotation();
      const double factor = m.T_2_1.t.dot(rest * m.normal_1);
      EXPECT_GT(factor, 0.0);
      EXPECT_LT((rest - factor * m.T_2_1.t * m.normal_1.transpose()).norm(), 1e-7);
      best = std::min(best, s.T_2_1.boxminus_to(m.T_2_1).norm() + (m.normal_1 - s.normal_1).norm());
    }
    EXPECT_LT(best, 1e-6) << k;
  }
  EXPECT_EQ(decompose_homography(so3_exp({0.1, 0.2, 0.3}).toRotationMatrix()).count, 0U);
}

TEST(Homography, IsFittedFromFourMatchesAndNotFromALine) {
  Rng rng(9);
  for (int k = 0; k < 100; ++k) {
    const PlaneScene s = random_plane(rng);
    std::vector<Eigen::Vector3d> b1, b2;
    while (b1.size() < 4) {
      const Eigen::Vector3d b = direction(rng);
      if (s.normal_1.dot(b) < 0.2) continue;
      b1.push_back(b);
      b2.push_back((s.h * b).normalized());
    }
    Eigen::Matrix3d h;
    ASSERT_TRUE(fit_homography(b1, b2, std::vector<uint8_t>(4, 1), &h));
    EXPECT_LT((h - s.h / s.h.norm()).norm(), 1e-4) << k;
  }
  std::vector<Eigen::Vector3d> line;
  for (int i = 0; i < 4; ++i) line.push_back(Eigen::Vector3d(0.1 * i, 0.0, 1.0).normalized());
  Eigen::Matrix3d h;
  EXPECT_FALSE(fit_homography(line, line, std::vector<uint8_t>(4, 1), &h));
}

TEST(Homography, IsRefinedToTheNoiseDespiteWrongMatches) {
  Rng rng(11);
  const double sigma = 1e-3;
  double start_error = 0.0, linear_error = 0.0, refined_error = 0.0;
  for (int k = 0; k < 60; ++k) {
    const PlaneScene s = random_plane(rng);
    const Eigen::Matrix3d truth = s.h / s.h.norm();
    std::vector<Eigen::Vector3d> b1, b2;
    while (b1.size() < 120) {
      const Eigen::Vector3d b = direction(rng);
      if (s.normal_1.dot(b) < 0.2) continue;
      b1.push_back(noisy(rng, b, sigma));
      b2.push_back(b1.size() <= 100 ? noisy(rng, (s.h * b).normalized(), sigma) : direction(rng));
    }
    Eigen::Matrix3d start = truth, linear;
    for (Eigen::Index i = 0; i < 9; ++i) start(i) += 1e-3 * gauss(rng);
    start /= start.norm();
    ASSERT_TRUE(fit_homography(b1, b2, std::vector<uint8_t>(120, 1), &linear));
    start_error += (start - truth).norm() / 60;
    linear_error += (linear - truth).norm() / 60;
    refined_error += (refine_homography(b1, b2, sigma, start) - truth).norm() / 60;
  }
  // 100 matches of two residuals each over eight parameters: about sigma * sqrt(8 / 200), times the plane's
  // dilution.
  EXPECT_LT(refined_error, 0.8 * sigma);
  EXPECT_GT(start_error, 3.0 * refined_error);
  EXPECT_GT(linear_error, 50.0 * refined_error);
}

TEST(Rotation, IsFittedFromTwoMatchesAndNeverAReflection) {
  Rng rng(10);
  for (int k = 0; k < 200; ++k) {
    const Eigen::Quaterniond truth = random_pose(rng, 3.1, 1.0).q;
    std::vector<Eigen::Vector3d> b1 = {direction(rng), direction(rng)}, b2;
    for (const Eigen::Vector3d& b : b1) b2.push_back(truth * b);
    const Eigen::Matrix3d r = fit_rotation(b1, b2, std::vector<uint8_t>(2, 1));
    EXPECT_NEAR(r.determinant(), 1.0, 1e-12);
    EXPECT_LT((r - truth.toRotationMatrix()).norm(), 1e-6 / b1[0].cross(b1[1]).norm());
  }
}

}  // namespace
}  // namespace farpoint::slam
