// SPDX-License-Identifier: Apache-2.0
// Umeyama alignment.
#include "slam/geometry/point_alignment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "tests/geometry/random_geometry.h"

namespace farpoint::slam {
namespace {

using testing::direction;
using testing::gauss3;
using testing::random_pose;
using testing::Rng;
using testing::uniform;

TEST(Alignment, RecoversSimilaritiesAndRigidMotions) {
  Rng rng(1);
  for (int k = 0; k < 300; ++k) {
    const SE3 pose = random_pose(rng, 3.14, 1000.0);
    const bool metric = k % 2 == 0;
    const Sim3 truth = {metric ? 1.0 : std::exp(uniform(rng, -4.0, 4.0)), pose.q, pose.t};
    std::vector<Eigen::Vector3d> source, target;
    const Eigen::Vector3d centre = 100.0 * gauss3(rng);
    // A third of them flat: a vehicle's path often is, and leaves the sign of the third axis to the
    // determinant.
    const double height = k % 3 == 0 ? 0.0 : 1.0;
    for (int i = 0; i < 30; ++i) {
      Eigen::Vector3d p = 10.0 * gauss3(rng);
      p.z() *= height;
      source.push_back(centre + p);
      target.push_back(truth * source.back());
    }
    const PointAlignment found =
        align_points(source, target, metric ? AlignmentKind::kSe3 : AlignmentKind::kSim3);
    ASSERT_TRUE(found.ok);
    EXPECT_NEAR(found.S_target_source.scale / truth.scale, 1.0, 1e-10);
    EXPECT_LT((found.S_target_source.q.toRotationMatrix() - truth.q.toRotationMatrix()).norm(), 1e-9);
    EXPECT_LT(found.rmse, 1e-8 * (1.0 + truth.scale));
  }
}

TEST(Alignment, NeverReflects) {
  // A mirrored cloud has no exact alignment; the answer is the best rotation, and its scale shrinks.
  Rng rng(2);
  for (int k = 0; k < 50; ++k) {
    std::vector<Eigen::Vector3d> source, target;
    for (int i = 0; i < 40; ++i) {
      source.push_back(gauss3(rng).cwiseProduct(Eigen::Vector3d(3, 2, 1)));
      target.push_back(source.back().cwiseProduct(Eigen::Vector3d(1, 1, -1)));
    }
    const PointAlignment found = align_points(source, target, AlignmentKind::kSim3);
    ASSERT_TRUE(found.ok);
    EXPECT_NEAR(found.S_target_source.q.toRotationMatrix().determinant(), 1.0, 1e-12);
    EXPECT_GT(found.rmse, 0.5);
    EXPECT_LT(found.S_target_source.scale, 1.0);
    // No neighbour is better.
    const auto cost = [&](const Sim3& s) {
      double sum = 0.0;
      for (size_t i = 0; i < source.size(); ++i) sum += (target[i] - s * source[i]).squaredNorm();
      return sum;
    };
    for (int n = 0; n < 20; ++n) {
      Sim3 other = found.S_target_source;
      other.q = other.q * so3_exp(1e-3 * direction(rng));
      other.scale *= 1.0 + uniform(rng, -1e-3, 1e-3);
      other.t += 1e-3 * gauss3(rng);
      EXPECT_GE(cost(other), cost(found.S_target_source));
    }
  }
}

// The same numbers through /work/shared/check/ate.py's align() give scale 1.999713428 and rmse 0.156674245
// (sim3), and rmse 5.287298970 (se3).
TEST(Alignment, AgreesWithTheIndependentChecker) {
  std::vector<Eigen::Vector3d> source, target;
  for (int i = 0; i < 12; ++i) {
    source.emplace_back(i, std::sin(i), 0.1 * i * i);
    target.emplace_back(2 * std::sin(i) + 0.1 * std::cos(3.0 * i), -2.0 * i + 0.2 * std::sin(5.0 * i),
                        0.2 * i * i + 1);
  }
  const PointAlignment sim3 = align_points(source, target, AlignmentKind::kSim3);
  EXPECT_NEAR(sim3.S_target_source.scale, 1.999713428, 1e-8);
  EXPECT_NEAR(sim3.rmse, 0.156674245, 1e-8);
  EXPECT_NEAR(align_points(source, target, AlignmentKind::kSe3).rmse, 5.287298970, 1e-8);
}

TEST(Alignment, RefusesWhatFixesNothing) {
  const std::vector<Eigen::Vector3d> two(2, Eigen::Vector3d::Ones()), three(3, Eigen::Vector3d::Ones());
  EXPECT_FALSE(align_points(two, two, AlignmentKind::kSe3).ok);
  EXPECT_FALSE(align_points(three, three, AlignmentKind::kSim3).ok);
  std::vector<Eigen::Vector3d> bad = {{0, 0, 0}, {1, 0, 0}, {0, 1, std::numeric_limits<double>::quiet_NaN()}};
  EXPECT_FALSE(align_points(bad, bad, AlignmentKind::kSim3).ok);
}

}  // namespace
}  // namespace farpoint::slam
