// SPDX-License-Identifier: Apache-2.0
// IMU and WHEELS messages on their way from a log into the estimator.
#include "daemon/input/measurement_feed.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "ipc/channels.h"
#include "ipc/log.h"
#include "tests/daemon/run_daemon.h"
#include "tests/daemon/synthetic_log.h"
#include "tests/ipc/scratch.h"

namespace farpoint::daemon {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr int kFrames = 12, kImuAFrame = 5;

imu_t imu(std::int64_t utime) {
  imu_t m{};
  m.utime = utime;
  m.acceleration[2] = 9.81;
  return m;
}

wheels_t wheels(std::int64_t utime, double speed) {
  wheels_t m{};
  m.utime = utime;
  m.speed = speed;
  m.speed_sigma = -1.0;
  m.yaw_rate = kNan;
  m.steering_angle = kNan;
  return m;
}

TEST(MeasurementFeed, ASampleHasTheMessagesAxesAndUnits) {
  imu_t m = imu(123);
  m.angular_velocity[0] = 0.1, m.angular_velocity[1] = 0.2, m.angular_velocity[2] = 0.3;
  const slam::ImuSample sample = make_sample(m);
  EXPECT_EQ(sample.utime, 123);
  EXPECT_EQ(sample.gyro_rad_per_s, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(sample.accel_m_per_s2, Eigen::Vector3d(0.0, 0.0, 9.81));
}

TEST(MeasurementFeed, WheelsOfTheRearAxleGiveTheYawRateThatAMessageLacks) {
  const slam::WheelConfig config{.track_m = 1.6};
  wheels_t m = wheels(123, 10.0);
  m.wheel_speed = {9.0, 12.0, 9.84, 10.16};
  slam::WheelSample sample = make_sample(m, config);
  EXPECT_NEAR(sample.yaw_rate_rad_per_s, 0.2, 1e-12) << "left turn: the right wheel is the faster one";
  // Tyres that differ by 3 thousandths, and wheels.yaw_rate_sigma_radps.
  EXPECT_NEAR(sample.sigma_yaw_rate_rad_per_s, std::hypot(0.003 * 10.0 / 1.6, 0.01), 1e-12);
  m.wheel_speed = {9.84, 10.16};
  EXPECT_NEAR(make_sample(m, config).yaw_rate_rad_per_s, 0.2, 1e-12) << "one axle";
  m.yaw_rate = -0.3;
  EXPECT_EQ(make_sample(m, config).yaw_rate_rad_per_s, -0.3) << "the message's own counts";
  m.yaw_rate = kNan;
  EXPECT_TRUE(std::isinf(make_sample(m, {}).sigma_yaw_rate_rad_per_s)) << "no track is given";
  m.wheel_speed[0] = kNan;
  EXPECT_TRUE(std::isinf(make_sample(m, config).sigma_yaw_rate_rad_per_s));
  m.wheel_speed = {10.0, 10.0, 10.0};
  EXPECT_TRUE(std::isinf(make_sample(m, config).sigma_yaw_rate_rad_per_s)) << "three wheels are no axle";
}

TEST(MeasurementFeed, WhatWheelsDoNotKnowWeighsNothing) {
  wheels_t m = wheels(123, 4.0);
  slam::WheelSample sample = make_sample(m, {});
  EXPECT_EQ(sample.utime, 123);
  EXPECT_EQ(sample.speed_m_per_s, 4.0);
  EXPECT_EQ(sample.sigma_speed_m_per_s, 0.0) << "unknown: the receiver's own";
  EXPECT_EQ(sample.yaw_rate_rad_per_s, 0.0);
  EXPECT_TRUE(std::isinf(sample.sigma_yaw_rate_rad_per_s));
  m.speed = kNan, m.speed_sigma = 0.2, m.yaw_rate = 0.5;
  sample = make_sample(m, {});
  EXPECT_EQ(sample.speed_m_per_s, 0.0);
  EXPECT_TRUE(std::isinf(sample.sigma_speed_m_per_s));
  EXPECT_EQ(sample.yaw_rate_rad_per_s, 0.5);
  EXPECT_EQ(sample.sigma_yaw_rate_rad_per_s, 0.0);
}

// Images with IMU samples between them, one of wheels with each, and after the sixth image a sample of before
// it and one of wheels without value.
class FedLog : public ::testing::Test {
 protected:
  void SetUp() override {
    ipc::LogWriter log(scratch_.path("run.lcm"));
    log.write_message("CALIBRATION", 0, test::synthetic_calibration());
    const test::SyntheticLog world;
    for (int i = 0; i < kFrames; ++i) {
      const image_t image = test::synthetic_image(world, i);
      for (int k = 1; k <= kImuAFrame; ++k)
        write(&log, "IMU", imu(image.utime - world.period_us + k * world.period_us / kImuAFrame));
      write(&log, "WHEELS", wheels(image.utime, 1.5));
      write(&log, "CAMERA_0", image);
      if (i == 5) write(&log, "WHEELS", wheels(image.utime + 10, kNan));
    }
    log.close();
  }
  template <typename Message>
  static void write(ipc::LogWriter* log, const char* channel, const Message& m) {
    ASSERT_TRUE(log->write_message(channel, m.utime, m));
  }
  // Messages of this type in the output of a replay with these options.
  template <typename Message>
  [[nodiscard]] std::vector<Message> replay(std::vector<std::string> options, const char* channel,
                                            const std::string& out) {
    options.insert(options.begin(), {"--replay", scratch_.path("run.lcm"), "--output", scratch_.path(out)});
    const test::Outcome o = test::run_daemon(std::move(options));
    EXPECT_EQ(o.status, 0) << o.err;
    return test::messages_of<Message>(scratch_.path(out), channel);
  }

  test::Scratch scratch_;
};

TEST_F(FedLog, EveryFrameTakesTheSamplesSinceTheOneBefore) {
  const auto status =
      replay<status_t>({"--lockstep", "--set", "lcm.status_rate_hz=100"}, "FARPOINT_STATUS", "out.lcm");
  ASSERT_EQ(status.size(), static_cast<std::size_t>(kFrames));
  // Those before the first image are passed over.
  EXPECT_EQ(status[0].imu_used, 0);
  EXPECT_EQ(status[0].wheels_used, 0);
  for (int i = 1; i < kFrames; ++i) {
    EXPECT_EQ(status[static_cast<std::size_t>(i)].imu_used, i * kImuAFrame);
    EXPECT_EQ(status[static_cast<std::size_t>(i)].wheels_used, i);
  }
  EXPECT_EQ(status.back().wheels_invalid, 1);
  EXPECT_EQ(status.back().imu_late, 0);
  EXPECT_EQ(status.back().imu_dropped, 0);
}

TEST_F(FedLog, ARecordedScheduleTakesTheSameSamplesAgain) {
  const auto run = replay<schedule_t>({"--speed", "3"}, "FARPOINT_SCHEDULE", "out.lcm");
  ASSERT_FALSE(run.empty());
  EXPECT_GT(run.back().imu_taken, 0);
  EXPECT_GT(run.back().wheels_taken, 0);
  const auto again =
      replay<schedule_t>({"--schedule", "recorded", "--schedule-log", scratch_.path("out.lcm")},
                         "FARPOINT_SCHEDULE", "again.lcm");
  ASSERT_EQ(again.size(), run.size());
  for (std::size_t i = 0; i < run.size(); ++i) {
    EXPECT_EQ(again[i].imu_taken, run[i].imu_taken) << i;
    EXPECT_EQ(again[i].wheels_taken, run[i].wheels_taken) << i;
    EXPECT_EQ(again[i].replies_taken, run[i].replies_taken) << i;
  }
}

// A schedule in which a frame took fewer samples than there were: the repeated frame leaves the others to the
// next.
TEST_F(FedLog, ARecordedScheduleDecidesHowManySamplesAFrameTakes) {
  const auto run = replay<schedule_t>({"--speed", "3"}, "FARPOINT_SCHEDULE", "out.lcm");
  ASSERT_GT(run.size(), 3U);
  const std::size_t fewer = run.size() / 2;
  {
    ipc::LogWriter log(scratch_.path("other.lcm"));
    for (std::size_t i = 0; i < run.size(); ++i) {
      schedule_t m = run[i];
      if (i == fewer) m.imu_taken -= 2;
      write(&log, "FARPOINT_SCHEDULE", m);
    }
    log.close();
  }
  const auto again =
      replay<schedule_t>({"--schedule", "recorded", "--schedule-log", scratch_.path("other.lcm")},
                         "FARPOINT_SCHEDULE", "again.lcm");
  ASSERT_EQ(again.size(), run.size());
  EXPECT_EQ(again[fewer].imu_taken, run[fewer].imu_taken - 2);
  EXPECT_EQ(again[fewer + 1].imu_taken, run[fewer + 1].imu_taken)
      << "the two are late now, and taken all the same";
}

}  // namespace
}  // namespace farpoint::daemon
