// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/mavlink_odometry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace farpoint::daemon {
namespace {

using ipc::mavlink::Odometry;
using ipc::mavlink::Triangle;
using slam::Matrix6d;

constexpr double kQuarter = M_PI / 2;

FrameOutput frame_at(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation) {
  FrameOutput frame;
  frame.valid = true;
  frame.result.scale = slam::ScaleState::kMetric;
  frame.result.T_odom_body = {orientation, position};
  frame.result.quality = 80;
  return frame;
}

Eigen::Quaterniond about(const Eigen::Vector3d& axis, double angle_rad) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis));
}

float element(const Triangle& triangle, int row, int column) {
  int index = 0;
  for (int r = 0; r < row; ++r) index += 6 - r;
  return triangle.at(static_cast<std::size_t>(index + column - row));
}

void expect_near(const std::array<float, 3>& a, const Eigen::Vector3d& b) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(a.at(static_cast<std::size_t>(i)), b[i], 1e-5) << i;
}

// MAVLink's local frame: x as the body's at the start, y to the right, z down.
TEST(MavlinkOdometry, LeftAndUpBecomeRightAndDown) {
  FrameOutput frame = frame_at({1, 2, 3}, Eigen::Quaterniond::Identity());
  frame.result.velocity_body << 4, 5, 6, 0.1, 0.2, 0.3;
  const Odometry o = mavlink_odometry(frame, std::nullopt, 77);
  EXPECT_EQ(o.time_us, 77U);
  EXPECT_EQ(o.frame, 20);        // MAV_FRAME_LOCAL_FRD
  EXPECT_EQ(o.child_frame, 12);  // MAV_FRAME_BODY_FRD
  EXPECT_EQ(o.estimator, 2);     // MAV_ESTIMATOR_TYPE_VISION
  expect_near(o.position_m, {1, -2, -3});
  expect_near(o.velocity_m_s, {4, -5, -6});
  expect_near(o.rates_rad_s, {0.1, -0.2, -0.3});
  EXPECT_EQ(o.orientation_wxyz, (std::array<float, 4>{1, 0, 0, 0}));
}

// A turn to the left is a negative yaw of a vehicle whose z axis points down; the nose down is a negative
// pitch.
TEST(MavlinkOdometry, TheQuaternionTurnsTheBodyIntoTheLocalFrame) {
  const Eigen::Vector3d up(0, 0, 1), left(0, 1, 0), ahead(1, 0, 0);
  const auto turned = [&](const Eigen::Vector3d& axis, double angle_rad, const Eigen::Vector3d& body_frd) {
    const Odometry o = mavlink_odometry(frame_at({0, 0, 0}, about(axis, angle_rad)), std::nullopt, 0);
    const auto& q = o.orientation_wxyz;
    return Eigen::Vector3d(Eigen::Quaterniond(q[0], q[1], q[2], q[3]) * body_frd);
  };
  EXPECT_TRUE(turned(up, kQuarter, {1, 0, 0}).isApprox(Eigen::Vector3d(0, -1, 0), 1e-5));   // looks left
  EXPECT_TRUE(turned(left, kQuarter, {1, 0, 0}).isApprox(Eigen::Vector3d(0, 0, 1), 1e-5));  // looks down
  EXPECT_TRUE(
      turned(ahead, kQuarter, {0, 1, 0}).isApprox(Eigen::Vector3d(0, 0, 1), 1e-5));  // right side down
}

TEST(MavlinkOdometry, WithoutNoiseTheCovariancesAreUnknown) {
  const FrameOutput frame = frame_at({1, 2, 3}, Eigen::Quaterniond::Identity());
  Odometry o = mavlink_odometry(frame, std::nullopt, 0);
  EXPECT_TRUE(std::isnan(o.pose_covariance[0]));
  EXPECT_TRUE(std::isnan(o.velocity_covariance[0]));
  MeasurementNoise noise;
  noise.pose(2, 2) = std::numeric_limits<double>::infinity();
  noise.velocity.setIdentity();
  o = mavlink_odometry(frame, noise, 0);
  EXPECT_TRUE(std::isnan(o.pose_covariance[0]));
  EXPECT_EQ(o.velocity_covariance[0], 1.0F);
}

// Numbers that tell each element apart; expected by finite differences of the quantities that MAVLink names.
TEST(MavlinkOdometry, PoseCovarianceIsThatOfThePositionAndTheAnglesInTheLocalFrame) {
  Matrix6d root = Matrix6d::Zero();
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c <= r; ++c) root(r, c) = 0.1 * (1 + r) - 0.03 * c * c + (r == c ? 0.5 : 0);
  MeasurementNoise noise;
  noise.pose = root * root.transpose();
  const FrameOutput frame =
      frame_at({1, 2, 3}, about({0, 0, 1}, 0.7) * about({0, 1, 0}, -0.4) * about({1, 0, 0}, 0.3));
  // x y z roll pitch yaw of the message for a pose that is off by `error` in body axes.
  const auto states = [&frame](const slam::Vector6d& error) {
    FrameOutput moved = frame;
    slam::SE3& T = moved.result.T_odom_body;
    T.t += T.q * error.head<3>();
    T.q = T.q * slam::so3_exp(error.tail<3>());
    const Odometry o = mavlink_odometry(moved, std::nullopt, 0);
    const Eigen::Matrix3d R = Eigen::Quaterniond(o.orientation_wxyz[0], o.orientation_wxyz[1],
                                                 o.orientation_wxyz[2], o.orientation_wxyz[3])
                                  .toRotationMatrix();
    slam::Vector6d s;
    s << o.position_m[0], o.position_m[1], o.position_m[2], std::atan2(R(2, 1), R(2, 2)), -std::asin(R(2, 0)),
        std::atan2(R(1, 0), R(0, 0));
    return s;
  };
  Matrix6d J;
  constexpr double kStep = 1e-2;  // the message has single precision
  for (int i = 0; i < 6; ++i) {
    slam::Vector6d step = slam::Vector6d::Zero();
    step[i] = kStep;
    J.col(i) = (states(step) - states(-step)) / (2 * kStep);
  }
  const Matrix6d expected = J * noise.pose * J.transpose();
  const Odometry o = mavlink_odometry(frame, noise, 0);
  for (int r = 0; r < 6; ++r)
    for (int c = r; c < 6; ++c)
      EXPECT_NEAR(element(o.pose_covariance, r, c), expected(r, c), 2e-3) << r << ' ' << c;
}

TEST(MavlinkOdometry, VelocityCovarianceChangesSignWithItsAxes) {
  MeasurementNoise noise;
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c < 6; ++c) noise.velocity(r, c) = 1 + std::min(r, c) + 10 * std::max(r, c);
  const Odometry o = mavlink_odometry(frame_at({0, 0, 0}, about({0, 0, 1}, 1.0)), noise, 0);
  const auto sign = [](int i) { return i % 3 == 0 ? 1 : -1; };
  for (int r = 0; r < 6; ++r)
    for (int c = r; c < 6; ++c)
      EXPECT_FLOAT_EQ(element(o.velocity_covariance, r, c),
                      static_cast<float>(sign(r) * sign(c) * (1 + r + 10 * c)))
          << r << ' ' << c;
}

TEST(MavlinkOdometry, StraightUpTheAnglesHaveNoCovariance) {
  MeasurementNoise noise;
  noise.pose.setIdentity();
  const Odometry o = mavlink_odometry(frame_at({0, 0, 0}, about({0, 1, 0}, kQuarter)), noise, 0);
  EXPECT_TRUE(std::isnan(o.pose_covariance[0]));
}

TEST(MavlinkOdometry, NothingIsSentWithoutMetresOrWithoutAPoseInTime) {
  FrameOutput frame = frame_at({0, 0, 0}, Eigen::Quaterniond::Identity());
  EXPECT_EQ(hold_of(frame, 0), MavlinkHold::kNone);
  EXPECT_EQ(hold_of(frame, 250'000), MavlinkHold::kNone);
  EXPECT_EQ(hold_of(frame, 250'001), MavlinkHold::kNoPose);
  frame.result.scale = slam::ScaleState::kAssumed;
  EXPECT_EQ(hold_of(frame, 0), MavlinkHold::kNone);
  frame.result.scale = slam::ScaleState::kUnknown;
  EXPECT_EQ(hold_of(frame, 0), MavlinkHold::kNoScale);
  frame.valid = false;
  EXPECT_EQ(hold_of(frame, 0), MavlinkHold::kNoPose);
}

// MAVLink: -1 failed, 0 unknown, 1 worst, 100 best.
TEST(MavlinkOdometry, QualityIsNeverUnknownWhereItIsKnown) {
  FrameOutput frame = frame_at({0, 0, 0}, Eigen::Quaterniond::Identity());
  for (const auto& [ours, theirs] : {std::pair{-1, 0}, {0, 1}, {1, 1}, {55, 55}, {100, 100}}) {
    frame.result.quality = ours;
    EXPECT_EQ(mavlink_odometry(frame, std::nullopt, 0).quality, theirs) << ours;
  }
}

TEST(MavlinkOdometry, TheCounterChangesWithResetsAndStarts) {
  FrameOutput frame = frame_at({0, 0, 0}, Eigen::Quaterniond::Identity());
  const auto counter = [&frame](std::uint32_t resets, std::int32_t start) {
    frame.result.reset_counter = resets;
    frame.boot_counter = start;
    return mavlink_odometry(frame, std::nullopt, 0).reset_counter;
  };
  EXPECT_EQ(counter(8, 0), counter(7, 0) + 1);
  EXPECT_EQ(counter(256, 0), 0);
  for (std::uint32_t resets = 0; resets < 50; ++resets)
    EXPECT_NE(counter(resets, 5), counter(0, 6)) << resets;
}

}  // namespace
}  // namespace farpoint::daemon
