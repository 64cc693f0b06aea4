// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/velocity_filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace farpoint::slam {
namespace {

constexpr double kFrame_s = 0.1;
const Vector6d kNoise = Vector6d::Constant(1e-6);

// The end of an arc of this velocity.
SE3 arc(const Vector6d& velocity, double dt_s) {
  constexpr int kSteps = 1000;
  SE3 T;
  for (int i = 0; i < kSteps; ++i) T = T.boxplus(velocity * (dt_s / kSteps));
  return T;
}

Vector6d forward(double speed, double yaw_rate) {
  return (Vector6d() << speed, 0, 0, 0, 0, yaw_rate).finished();
}

TEST(VelocityFilter, AlongACircleItPointsAheadAndNotAcross) {
  VelocityFilter filter;
  const Vector6d velocity = forward(10.0, 0.6);
  for (int i = 0; i < 20; ++i) filter.advance(arc(velocity, kFrame_s), kFrame_s, kNoise, 1.0);
  EXPECT_LT((filter.velocity() - velocity).norm(), 0.01);
}

// The difference of two poses would be late by half a period: by 0.1 m/s and 0.025 rad/s.
TEST(VelocityFilter, IsThatOfTheNewestFrameWhileTheVehicleBrakesAndTurnsIn) {
  VelocityFilter filter;
  constexpr double kBrake = -2.0, kTurnIn = 0.5;
  for (int i = 0; i < 30; ++i) {
    const double middle_s = kFrame_s * (i + 0.5);
    const Vector6d mean = forward(20.0 + kBrake * middle_s, kTurnIn * middle_s);
    filter.advance(arc(mean, kFrame_s), kFrame_s, kNoise, 1.0);
  }
  constexpr double kNow_s = 3.0;
  EXPECT_NEAR(filter.velocity()[0], 20.0 + kBrake * kNow_s, 0.02);
  EXPECT_NEAR(filter.velocity()[5], kTurnIn * kNow_s, 0.005);
}

// Motion as the filter assumes it, measured with the noise that it is given.
TEST(VelocityFilter, ItsCovarianceIsThatOfItsError) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  const double sigma = std::sqrt(4e-4), jerk = std::sqrt(5.0 * kFrame_s);
  double sum = 0.0, covariance_falls = 0.0;
  int count = 0;
  for (int run = 0; run < 60; ++run) {
    VelocityFilter filter;
    double velocity = 10.0, acceleration = 0.0, error = sigma * normal(random);
    for (int i = 0; i < 40; ++i) {
      const double way = (velocity + 0.5 * acceleration * kFrame_s) * kFrame_s;
      velocity += acceleration * kFrame_s;
      acceleration += jerk * normal(random);
      const double next = sigma * normal(random);
      filter.advance({Eigen::Quaterniond::Identity(), {way + next - error, 0, 0}}, kFrame_s,
                     Vector6d::Constant(sigma * sigma), 1.0);
      error = next;
      if (i < 10) continue;
      sum += std::pow(filter.velocity()[0] - velocity, 2) / filter.covariance()(0, 0);
      covariance_falls = filter.covariance()(0, 0);
      ++count;
    }
  }
  EXPECT_GT(sum / count, 0.7);
  EXPECT_LT(sum / count, 1.4);
  EXPECT_LT(covariance_falls, 2.0 * sigma * sigma / (kFrame_s * kFrame_s));  // better than a difference
}

TEST(VelocityFilter, IsUnknownBeforeTheFirstMotionAndAfterAGap) {
  VelocityFilter filter;
  EXPECT_TRUE(filter.covariance().array().isNaN().all());
  filter.advance(arc(forward(1, 0), kFrame_s), kFrame_s, kNoise, 1.0);
  EXPECT_TRUE(filter.covariance().allFinite());
  EXPECT_NEAR(filter.velocity()[0], 1.0, 1e-9);
  filter.advance(arc(forward(1, 0), 2.0), 2.0, kNoise, 1.0);
  EXPECT_TRUE(filter.covariance().array().isNaN().all());
  EXPECT_EQ(filter.velocity(), Vector6d::Zero());
}

TEST(VelocityFilter, FollowsTheUnitOfTheMap) {
  VelocityFilter filter;
  for (int i = 0; i < 5; ++i) filter.advance(arc(forward(1, 0.2), kFrame_s), kFrame_s, kNoise, 1.0);
  const Matrix6d before = filter.covariance();
  filter.change_unit(3.0);
  EXPECT_NEAR(filter.velocity()[0], 3.0, 0.01);
  EXPECT_NEAR(filter.velocity()[5], 0.2, 0.01);
  EXPECT_NEAR(filter.covariance()(0, 0), 9.0 * before(0, 0), 1e-12);
  EXPECT_EQ(filter.covariance()(5, 5), before(5, 5));
}

}  // namespace
}  // namespace farpoint::slam
