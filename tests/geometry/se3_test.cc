// SPDX-License-Identifier: Apache-2.0
// Properties of rotations, rigid motions and similarities over random and special elements.
#include "slam/geometry/se3.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "tests/geometry/random_geometry.h"

namespace farpoint::slam {
namespace {

using testing::direction;
using testing::gauss3;
using testing::random_pose;
using testing::Rng;
using testing::special_rotation_vectors;
using testing::uniform;

constexpr double kPi = std::numbers::pi;

std::vector<Eigen::Vector3d> rotation_vectors() {
  std::vector<Eigen::Vector3d> all = special_rotation_vectors();
  Rng rng(1);
  for (int i = 0; i < 1000; ++i) all.push_back(direction(rng) * uniform(rng, 0.0, kPi - 1e-6));
  return all;
}

std::vector<SE3> poses() {
  std::vector<SE3> all;
  Rng rng(2);
  for (const Eigen::Vector3d& phi : special_rotation_vectors())
    all.push_back({so3_exp(phi), 10.0 * gauss3(rng)});
  all.push_back({Eigen::Quaterniond::Identity(), {1e6, -1e6, 1e-6}});
  for (int i = 0; i < 200; ++i) all.push_back(random_pose(rng, kPi, 100.0));
  return all;
}

double pose_distance(const SE3& a, const SE3& b) {
  return (a.rotation() - b.rotation()).norm() + (a.t - b.t).norm() / (1.0 + a.t.norm());
}

// Rodrigues' formula, in long double: a second way to the same matrix.
Eigen::Matrix3d rodrigues(const Eigen::Vector3d& phi) {
  const long double theta = std::sqrt(static_cast<long double>(phi.squaredNorm()));
  const Eigen::Matrix3d k = skew(phi);
  const double a = theta > 1e-6L ? static_cast<double>(std::sin(theta) / theta) : 1.0;
  const double b = theta > 1e-6L ? static_cast<double>((1.0L - std::cos(theta)) / (theta * theta)) : 0.5;
  return Eigen::Matrix3d::Identity() + a * k + b * k * k;
}

TEST(So3, ExpIsRodriguesFormula) {
  for (const Eigen::Vector3d& phi : rotation_vectors()) {
    const Eigen::Quaterniond q = so3_exp(phi);
    EXPECT_NEAR(q.norm(), 1.0, 1e-15);
    EXPECT_LT((q.toRotationMatrix() - rodrigues(phi)).norm(), 1e-12) << phi.transpose();
  }
}

TEST(So3, LogUndoesExp) {
  for (const Eigen::Vector3d& phi : rotation_vectors()) {
    const Eigen::Vector3d back = so3_log(so3_exp(phi));
    EXPECT_LT((back - phi).norm(), 1e-14) << phi.transpose();
    // Relative precision too: 1e-12 rad must not come back as zero.
    if (phi.norm() > 0.0) {
      EXPECT_LE((back - phi).lpNorm<Eigen::Infinity>() / phi.lpNorm<Eigen::Infinity>(), 1e-12)
          << phi.transpose();
    }
  }
}

TEST(So3, LogIsTheSameForBothQuaternionsAndAtMostPi) {
  Rng rng(3);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Quaterniond q = so3_exp(direction(rng) * uniform(rng, 0.0, 2.0 * kPi));
    const Eigen::Quaterniond minus(-q.w(), -q.x(), -q.y(), -q.z());
    EXPECT_LE(so3_log(q).norm(), kPi + 1e-15);
    if (so3_log(q).norm() < kPi - 1e-9) {
      EXPECT_LT((so3_log(q) - so3_log(minus)).norm(), 1e-14);
    }
  }
  // Exactly half a turn: either sign of the axis is right.
  EXPECT_NEAR(so3_log(Eigen::Quaterniond(0, 1, 0, 0)).norm(), kPi, 1e-15);
  EXPECT_NEAR(std::abs(so3_log(Eigen::Quaterniond(0, 0, 0, -1)).z()), kPi, 1e-15);
}

TEST(So3, ExpIsAHomomorphismAlongAnAxis) {
  Rng rng(4);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d axis = direction(rng);
    const double a = uniform(rng, -3.0, 3.0), b = uniform(rng, -3.0, 3.0);
    const Eigen::Matrix3d product = (so3_exp(a * axis) * so3_exp(b * axis)).toRotationMatrix();
    EXPECT_LT((product - so3_exp((a + b) * axis).toRotationMatrix()).norm(), 1e-13);
  }
}

TEST(So3, SkewIsTheCrossProduct) {
  Rng rng(5);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d a = gauss3(rng), b = gauss3(rng);
    EXPECT_LT((skew(a) * b - a.cross(b)).norm(), 1e-14);
    EXPECT_EQ(skew(a).transpose(), -skew(a));
  }
}

TEST(Se3, IsAGroup) {
  const std::vector<SE3> all = poses();
  const SE3 identity;
  for (size_t i = 0; i < all.size(); ++i) {
    const SE3 &a = all[i], &b = all[(7 * i + 3) % all.size()], &c = all[(11 * i + 5) % all.size()];
    EXPECT_LT(pose_distance(a * identity, a), 1e-14);
    EXPECT_LT(pose_distance(identity * a, a), 1e-14);
    EXPECT_LT(pose_distance((a * b) * c, a * (b * c)), 1e-12);
    const SE3 back = a * a.inverse();
    EXPECT_LT(back.t.norm(), 1e-14 * (1.0 + a.t.norm()));
    EXPECT_LT((back.rotation() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
    EXPECT_NEAR((a * b).q.norm(), 1.0, 1e-15);
  }
}

TEST(Se3, ActsOnPoints) {
  Rng rng(6);
  const std::vector<SE3> all = poses();
  for (size_t i = 0; i < all.size(); ++i) {
    const SE3 &a = all[i], &b = all[(7 * i + 3) % all.size()];
    const Eigen::Vector3d p = 20.0 * gauss3(rng), q = 20.0 * gauss3(rng);
    EXPECT_LT((a * p - (a.rotation() * p + a.t)).norm(), 1e-12 * (1.0 + a.t.norm()));
    EXPECT_LT(((a * b) * p - a * (b * p)).norm(), 1e-13 * (1.0 + a.t.norm() + b.t.norm() + p.norm()) * 10);
    EXPECT_NEAR((a * p - a * q).norm(), (p - q).norm(), 1e-9);
    EXPECT_LT((a.inverse() * (a * p) - p).norm(), 1e-13 * (1.0 + a.t.norm() + p.norm()) * 10);
  }
}

TEST(Se3, BoxplusIsRightAndDecoupledAndBoxminusUndoesIt) {
  Rng rng(7);
  for (const SE3& a : poses()) {
    Vector6d delta;
    delta << gauss3(rng), direction(rng) * uniform(rng, 0.0, 3.0);
    const SE3 moved = a.boxplus(delta);
    // The definition at the top of se3.h, with matrices.
    EXPECT_LT((moved.rotation() - a.rotation() * so3_exp(delta.tail<3>()).toRotationMatrix()).norm(), 1e-14);
    EXPECT_LT((moved.t - (a.t + a.rotation() * delta.head<3>())).norm(), 1e-14 * (10.0 + a.t.norm()));
    EXPECT_LT((a.boxminus_to(moved) - delta).norm(), 1e-13 * (10.0 + a.t.norm()));
    EXPECT_LT(pose_distance(a.boxplus(Vector6d::Zero()), a), 4e-15);
  }
}

TEST(Se3, FiniteSeesEveryComponent) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  SE3 pose;
  EXPECT_TRUE(pose.is_finite());
  pose.t.z() = nan;
  EXPECT_FALSE(pose.is_finite());
  pose.t.z() = 0.0;
  pose.q.w() = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(pose.is_finite());
}

Sim3 random_similarity(Rng& rng) {
  const SE3 pose = random_pose(rng, kPi, 50.0);
  return {std::exp(uniform(rng, -3.0, 3.0)), pose.q, pose.t};
}

TEST(Sim3Group, ComposesAndInverts) {
  Rng rng(8);
  for (int i = 0; i < 500; ++i) {
    const Sim3 a = random_similarity(rng), b = random_similarity(rng);
    const Eigen::Vector3d p = 10.0 * gauss3(rng);
    const double size = 1.0 + (a * (b * p)).norm() + a.scale * b.t.norm() + a.t.norm();
    EXPECT_LT(((a * b) * p - a * (b * p)).norm(), 1e-13 * size);
    EXPECT_LT((a.inverse() * (a * p) - p).norm(), 1e-13 * (1.0 + p.norm() + a.t.norm() / a.scale) * 10);
    EXPECT_NEAR((a * a.inverse()).scale, 1.0, 1e-15);
    EXPECT_LT((a * a.inverse()).t.norm(), 1e-13 * (1.0 + a.t.norm()));
  }
}

TEST(Sim3Group, MovesPosesSoThatScaledPointsAgree) {
  // B' in A, with lengths of B' measured in A's unit: a point p of B' lies at the same place whether it goes
  // through B as a point, or is scaled and goes through the moved pose.
  Rng rng(9);
  for (int i = 0; i < 500; ++i) {
    const Sim3 s = random_similarity(rng);
    const SE3 pose = random_pose(rng, kPi, 20.0);
    const Eigen::Vector3d p = 10.0 * gauss3(rng);
    const Eigen::Vector3d direct = s * (pose * p), moved = (s * pose) * Eigen::Vector3d(s.scale * p);
    EXPECT_LT((direct - moved).norm(), 1e-12 * (1.0 + direct.norm() + s.scale * 30.0));
  }
}

}  // namespace
}  // namespace farpoint::slam
