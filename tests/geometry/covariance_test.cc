// SPDX-License-Identifier: Apache-2.0
#include "slam/geometry/covariance.h"

#include <gtest/gtest.h>

#include <cmath>

namespace farpoint::slam {
namespace {

const SE3 kPose{so3_exp({0.4, -0.3, 1.1}), {5.0, -2.0, 0.7}};

// The motion of B's axes, seen as one of A's: T_A_B moved on the right is moved on the left by Ad.
TEST(Covariance, TheAdjointCarriesASmallMotionFromOneFrameToAnother) {
  constexpr double kStep = 1e-6;
  const Matrix6d Ad = adjoint(kPose);
  for (int i = 0; i < 6; ++i) {
    Vector6d delta = Vector6d::Zero();
    delta[i] = kStep;
    const Vector6d moved = SE3{}.boxminus_to(kPose.boxplus(delta) * kPose.inverse()) / kStep;
    EXPECT_LT((moved - Ad.col(i)).norm(), 1e-4) << i;
  }
}

TEST(Covariance, CarriedThereAndBackIsTheSame) {
  Matrix6d root = Matrix6d::Identity();
  root(4, 1) = 0.3, root(5, 0) = -0.2;
  const Matrix6d c = root * root.transpose();
  EXPECT_TRUE(carried(kPose.inverse(), carried(kPose, c)).isApprox(c, 1e-9));
  EXPECT_FALSE(carried(kPose, c).isApprox(c, 0.1));
}

TEST(Covariance, AnotherUnitChangesLengthsAndNoAngles) {
  const Matrix6d c = in_unit(Matrix6d::Constant(1.0), 3.0);
  EXPECT_EQ(c(0, 1), 9.0);
  EXPECT_EQ(c(2, 4), 3.0);
  EXPECT_EQ(c(5, 5), 1.0);
}

TEST(Covariance, UnknownIsNoNumber) {
  EXPECT_TRUE(unknown_covariance().array().isNaN().all());
}

}  // namespace
}  // namespace farpoint::slam
