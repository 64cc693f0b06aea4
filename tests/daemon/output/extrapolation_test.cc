// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/extrapolation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace farpoint::daemon {
namespace {

FrameOutput moving(const Eigen::Vector3d& velocity, const Eigen::Vector3d& turning) {
  FrameOutput f;
  f.valid = true;
  f.age_us = 20'000;
  f.result.state = slam::State::kTracking;
  f.result.has_pose = true;
  f.result.T_odom_body.t = {1, 2, 3};
  f.result.T_map_body.t = {-1, 0, 0};
  f.result.velocity_body << velocity, turning;
  return f;
}

TEST(Extrapolation, StraightOn) {
  const FrameOutput f = extrapolate(moving({10, 0, 0}, {0, 0, 0}), 0.05);
  EXPECT_NEAR(f.result.T_odom_body.t.x(), 1.5, 1e-12);
  EXPECT_NEAR(f.result.T_map_body.t.x(), -0.5, 1e-12);
  EXPECT_EQ(f.age_us, 70'000);
}

TEST(Extrapolation, MovesTheMapsPoseInTheMapsUnit) {
  FrameOutput frame = moving({10, 0, 0}, {0, 0, 0});
  frame.result.map_from_odom.scale = 2.0;
  const FrameOutput f = extrapolate(frame, 0.05);
  EXPECT_NEAR(f.result.T_odom_body.t.x(), 1.5, 1e-12);
  EXPECT_NEAR(f.result.T_map_body.t.x(), 0.0, 1e-12);
}

// A quarter of a circle of radius 10 m: exact way against the half-turn rule, in steps as they are used.
TEST(Extrapolation, FollowsACircle) {
  constexpr double kRadius_m = 10.0, kTurn_rad_s = 0.5, kStep_s = 0.02;
  FrameOutput f = moving({kRadius_m * kTurn_rad_s, 0, 0}, {0, 0, kTurn_rad_s});
  f.result.T_odom_body.t.setZero();
  const int steps = static_cast<int>(std::lround(0.5 * std::numbers::pi / kTurn_rad_s / kStep_s));
  for (int i = 0; i < steps; ++i) f = extrapolate(f, kStep_s);
  const double angle = kTurn_rad_s * kStep_s * steps;
  EXPECT_NEAR(f.result.T_odom_body.t.x(), kRadius_m * std::sin(angle), 1e-3);
  EXPECT_NEAR(f.result.T_odom_body.t.y(), kRadius_m * (1.0 - std::cos(angle)), 1e-3);
}

TEST(Extrapolation, WithoutAPoseItOnlyGrowsOlder) {
  FrameOutput f = moving({10, 0, 0}, {0, 0, 0});
  f.valid = false;
  const FrameOutput later = extrapolate(f, 0.1);
  EXPECT_EQ(later.age_us, 120'000);
  EXPECT_EQ(later.result.T_odom_body.t, f.result.T_odom_body.t);
  EXPECT_FALSE(later.valid);
}

}  // namespace
}  // namespace farpoint::daemon
