// SPDX-License-Identifier: Apache-2.0
#include "slam/fusion/wheel_track.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <random>

namespace farpoint::slam {
namespace {

constexpr std::int64_t kStep_us = 10'000;

// Samples every 10 ms of a vehicle with given speed and yaw rate at each time (s).
template <typename Speed, typename YawRate>
void drive(double seconds, Speed speed, YawRate yaw_rate, WheelTrack* track) {
  for (std::int64_t t = 0; t <= std::llround(1e6 * seconds); t += kStep_us) {
    const double s = 1e-6 * static_cast<double>(t);
    ASSERT_TRUE(track->add({t, speed(s), yaw_rate(s)}));
  }
}
auto constant(double value) {
  return [value](double) { return value; };
}

TEST(WheelTrack, StraightDriveIsSpeedTimesTime) {
  WheelTrack track;
  drive(2.0, constant(10.0), constant(0.0), &track);
  const auto motion = track.between(300'000, 1'500'000);
  ASSERT_TRUE(motion);
  EXPECT_NEAR(motion->displacement_m.x(), 12.0, 1e-9);
  EXPECT_NEAR(motion->displacement_m.y(), 0.0, 1e-12);
  EXPECT_EQ(motion->yaw_rad, 0.0);
}

TEST(WheelTrack, AnArcEndsWhereTheCircleDoes) {
  WheelTrack track;
  drive(2.0, constant(10.0), constant(-0.5), &track);
  const auto motion = track.between(0, 2'000'000);
  ASSERT_TRUE(motion);
  const double radius = -20.0;  // to the right
  EXPECT_NEAR(motion->yaw_rad, -1.0, 1e-9);
  EXPECT_NEAR(motion->displacement_m.x(), radius * std::sin(-1.0), 1e-9);
  EXPECT_NEAR(motion->displacement_m.y(), radius * (1.0 - std::cos(-1.0)), 1e-9);
}

TEST(WheelTrack, TimesBetweenSamplesAreInterpolated) {
  WheelTrack track;
  drive(
      1.0, [](double s) { return 4.0 * s; }, constant(0.0), &track);
  const auto motion = track.between(123'456, 654'321);
  ASSERT_TRUE(motion);
  EXPECT_NEAR(motion->displacement_m.x(), 2.0 * (0.654321 * 0.654321 - 0.123456 * 0.123456), 1e-9);
}

TEST(WheelTrack, MotionsCompose) {
  WheelTrack track;
  drive(
      2.0, [](double s) { return 5.0 + std::sin(s); }, [](double s) { return std::cos(3.0 * s); }, &track);
  const auto all = track.between(100'000, 1'900'003), first = track.between(100'000, 777'777),
             second = track.between(777'777, 1'900'003);
  ASSERT_TRUE(all && first && second);
  const Eigen::Vector2d end =
      first->displacement_m + Eigen::Rotation2Dd(first->yaw_rad) * second->displacement_m;
  // Halving a stretch of varying yaw rate moves its end by less than a tenth of a millimetre.
  EXPECT_LT((end - all->displacement_m).norm(), 1e-4);
  EXPECT_NEAR(first->yaw_rad + second->yaw_rad, all->yaw_rad, 1e-12);
}

TEST(WheelTrack, RefusesAndCountsLateAndInvalidSamples) {
  WheelTrack track;
  EXPECT_TRUE(track.add({1000, 1.0, 0.0}));
  EXPECT_FALSE(track.add({1000, 2.0, 0.0}));
  EXPECT_FALSE(track.add({999, 2.0, 0.0}));
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(track.add({2000, nan, 0.0}));
  EXPECT_FALSE(track.add({2000, 0.0, inf}));
  EXPECT_FALSE(track.add({2000, 0.0, 0.0, -1.0}));
  EXPECT_FALSE(track.add({2000, 0.0, 0.0, 0.0, nan}));
  EXPECT_TRUE(track.add({2000, 1.0, 0.0}));
  EXPECT_EQ(track.counts().taken, 2U);
  EXPECT_EQ(track.counts().late, 2U);
  EXPECT_EQ(track.counts().invalid, 4U);
  EXPECT_NEAR(track.between(1000, 2000)->displacement_m.x(), 1e-3, 1e-12);
}

TEST(WheelTrack, SaysNothingBeyondItsSamplesOrAcrossAGap) {
  WheelTrack track;
  EXPECT_FALSE(track.between(0, 1000));
  drive(1.0, constant(1.0), constant(0.0), &track);
  EXPECT_FALSE(track.between(-1, 500'000));
  EXPECT_FALSE(track.between(500'000, 1'000'001));
  EXPECT_FALSE(track.between(500'000, 500'000));
  EXPECT_FALSE(track.between(500'000, 400'000));
  EXPECT_TRUE(track.between(0, 1'000'000));
  ASSERT_TRUE(track.add({1'300'000, 1.0, 0.0}));  // 0.3 s later
  ASSERT_TRUE(track.add({1'310'000, 1.0, 0.0}));
  EXPECT_FALSE(track.between(900'000, 1'305'000));
  EXPECT_FALSE(track.between(1'100'000, 1'200'000));
  EXPECT_TRUE(track.between(1'300'000, 1'310'000));
  EXPECT_TRUE(track.between(900'000, 1'000'000));
}

TEST(WheelTrack, AFullRingForgetsItsOldest) {
  WheelOptions options;
  options.capacity = 16;
  WheelTrack track(options);
  drive(
      1.0, [](double s) { return s; }, constant(0.0), &track);
  EXPECT_EQ(track.size(), 16U);
  EXPECT_FALSE(track.between(840'000, 1'000'000));
  const auto motion = track.between(850'000, 1'000'000);
  ASSERT_TRUE(motion);
  EXPECT_NEAR(motion->displacement_m.x(), 0.5 * (1.0 - 0.85 * 0.85), 1e-9);
}

TEST(WheelTrack, ClearedItStartsAnew) {
  WheelTrack track;
  drive(1.0, constant(1.0), constant(0.0), &track);
  track.clear();
  EXPECT_FALSE(track.between(0, 1'000'000));
  EXPECT_TRUE(track.add({5, 1.0, 0.0}));
}

// Mean of e' C^-1 e over many noisy drives: three where the covariance is right.
TEST(WheelTrack, CovarianceIsThatOfTheReadingsNoise) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  WheelOptions options;
  options.sigma_slip_m_per_s = 0.05;
  constexpr int kTrials = 2000;
  double nees = 0;
  const auto yaw_rate = [](double s) { return 0.8 * s; };
  WheelTrack exact(options);
  drive(1.0, constant(8.0), yaw_rate, &exact);
  const auto truth = exact.between(0, 1'000'000);
  ASSERT_TRUE(truth);
  for (int i = 0; i < kTrials; ++i) {
    WheelTrack track(options);
    drive(
        1.0, [&](double) { return 8.0 + 0.2 * normal(random); },
        [&](double s) { return yaw_rate(s) + 0.05 * normal(random); }, &track);
    auto motion = track.between(0, 1'000'000);
    ASSERT_TRUE(motion);
    // The slip of each 10 ms moves the body across its heading.
    for (int k = 0; k < 100; ++k) {
      const double s = 0.01 * (k + 0.5), heading = 0.4 * s * s;
      motion->displacement_m +=
          0.05 * 0.01 * normal(random) * Eigen::Vector2d(-std::sin(heading), std::cos(heading));
    }
    WheelTrack told(options);
    for (std::int64_t t = 0; t <= 1'000'000; t += kStep_us)
      ASSERT_TRUE(told.add({t, 8.0, yaw_rate(1e-6 * static_cast<double>(t)), 0.2, 0.05}));
    const Eigen::Matrix3d covariance = told.between(0, 1'000'000)->covariance;
    Eigen::Vector3d e;
    e << motion->displacement_m - truth->displacement_m, motion->yaw_rad - truth->yaw_rad;
    nees += e.dot(covariance.inverse() * e);
  }
  // Standard deviation of the mean: sqrt(6 / 2000) = 0.055.
  EXPECT_NEAR(nees / kTrials, 3.0, 0.25);
}

}  // namespace
}  // namespace farpoint::slam
