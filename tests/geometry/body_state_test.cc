// SPDX-License-Identifier: Apache-2.0
#include "slam/geometry/body_state.h"

#include <gtest/gtest.h>

#include <random>

#include "slam/geometry/so3_jacobian.h"

namespace farpoint::slam {
namespace {

class BodyStateTest : public testing::Test {
 protected:
  double normal() { return std::normal_distribution<double>()(random_); }
  Eigen::Vector3d normal3() { return {normal(), normal(), normal()}; }
  BodyState random_state() {
    return {{so3_exp(2.0 * normal3()), 10.0 * normal3()}, 5.0 * normal3(), 0.1 * normal3(), 0.3 * normal3()};
  }
  Vector15d random_step(double size) {
    Vector15d d;
    for (int i = 0; i < 15; ++i) d[i] = size * normal();
    return d;
  }

  std::mt19937_64 random_{3};
};

TEST_F(BodyStateTest, BoxminusUndoesBoxplus) {
  for (int i = 0; i < 500; ++i) {
    const BodyState state = random_state();
    const Vector15d step = random_step(i % 2 == 0 ? 0.5 : 1e-7);
    const Vector15d back = state.boxminus_to(state.boxplus(step));
    EXPECT_LT((back - step).norm(), 1e-12 + 1e-12 * state.T_world_body.t.norm()) << i;
  }
}

TEST_F(BodyStateTest, BoxplusReachesWhatBoxminusPointsAt) {
  for (int i = 0; i < 500; ++i) {
    const BodyState from = random_state(), to = random_state();
    const BodyState reached = from.boxplus(from.boxminus_to(to));
    EXPECT_LT(reached.boxminus_to(to).norm(), 1e-11) << i;
  }
}

TEST_F(BodyStateTest, ZeroMovesNothing) {
  const BodyState state = random_state();
  EXPECT_EQ(state.boxminus_to(state.boxplus(Vector15d::Zero())).norm(), 0.0);
}

TEST_F(BodyStateTest, HalfATurnIsTheFurthest) {
  for (int i = 0; i < 100; ++i) {
    const BodyState state = random_state();
    BodyState turned = state;
    const Eigen::Vector3d axis = normal3().normalized();
    turned.T_world_body.q = turned.T_world_body.q * so3_exp((3.141592653589793 - 1e-6) * axis);
    const Vector15d step = state.boxminus_to(turned);
    EXPECT_NEAR(step.segment<3>(BodyState::kRotation).norm(), 3.141592653589793 - 1e-6, 1e-9);
    EXPECT_LT(state.boxplus(step).boxminus_to(turned).norm(), 1e-9);
    EXPECT_LT((step.segment<3>(BodyState::kRotation).normalized() - axis).norm(), 1e-6);
  }
}

TEST_F(BodyStateTest, EachPartOfThePerturbationMovesItsOwnPartAlone) {
  const BodyState state = random_state();
  const auto moved = [&](int first) {
    Vector15d step = Vector15d::Zero();
    step.segment<3>(first) = Eigen::Vector3d(0.1, 0.2, 0.3);
    return state.boxplus(step);
  };
  const auto expect_others_still = [&](const BodyState& other, int first) {
    Vector15d rest = state.boxminus_to(other);
    EXPECT_NEAR((rest.segment<3>(first) - Eigen::Vector3d(0.1, 0.2, 0.3)).norm(), 0.0, 1e-13) << first;
    rest.segment<3>(first).setZero();
    EXPECT_LT(rest.norm(), 1e-13) << first;
  };
  for (const int first : {BodyState::kTranslation, BodyState::kRotation, BodyState::kVelocity,
                          BodyState::kGyroscopeBias, BodyState::kAccelerometerBias})
    expect_others_still(moved(first), first);
  const Eigen::Vector3d d(0.1, 0.2, 0.3);
  // Translation in body axes; velocity in the world's.
  EXPECT_LT(
      (moved(BodyState::kTranslation).T_world_body.t - (state.T_world_body.t + state.T_world_body.q * d))
          .norm(),
      1e-13);
  EXPECT_LT((moved(BodyState::kVelocity).velocity_world - state.velocity_world - d).norm(), 1e-13);
}

TEST_F(BodyStateTest, RotationPerturbsOnTheRight) {
  const BodyState state = random_state();
  Vector15d step = Vector15d::Zero();
  step.segment<3>(BodyState::kRotation) = Eigen::Vector3d(0.3, -0.2, 0.1);
  const Eigen::Quaterniond q = state.boxplus(step).T_world_body.q;
  EXPECT_LT((state.T_world_body.q * so3_exp({0.3, -0.2, 0.1})).angularDistance(q), 1e-14);
}

// --- the derivatives of the logarithm
// ---------------------------------------------------------------

TEST_F(BodyStateTest, JacobiansOfTheLogarithmMatchNumericDifferences) {
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 200; ++i) {
    const double size = i % 4 == 0 ? 1e-5 : (i % 4 == 1 ? 1e-3 : 0.8);
    Eigen::Vector3d phi = size * normal3();
    if (phi.norm() > 2.9) phi *= 2.9 / phi.norm();
    const Eigen::Quaterniond q = so3_exp(phi);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(k);
      const Eigen::Vector3d right =
          (so3_log(q * so3_exp(step)) - so3_log(q * so3_exp(-step))) / (2.0 * kStep);
      const Eigen::Vector3d left = (so3_log(so3_exp(step) * q) - so3_log(so3_exp(-step) * q)) / (2.0 * kStep);
      EXPECT_LT((right - so3_right_jacobian_inverse(phi).col(k)).norm(), 1e-7) << phi.transpose();
      EXPECT_LT((left - so3_left_jacobian_inverse(phi).col(k)).norm(), 1e-7) << phi.transpose();
    }
  }
}

}  // namespace
}  // namespace farpoint::slam
