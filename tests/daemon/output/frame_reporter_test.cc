// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/frame_reporter.h"

#include <gtest/gtest.h>

#include "daemon/system/side_functions.h"
#include "ipc/channels.h"
#include "ipc/reason.h"
#include "tests/daemon/output/published.h"

namespace farpoint::daemon {
namespace {

class FrameReporterTest : public ::testing::Test {
 protected:
  FrameReporterTest() { publisher_.add(std::make_unique<test::KeptMessageSink>(&kept_)); }

  [[nodiscard]] static Config config() {
    Config c;
    c.lcm.status_rate_hz = 1.0;
    c.realtime.deadline_ms = 50.0;
    return c;
  }
  // A tracked frame at this place of odom and map.
  [[nodiscard]] static FramePackage package(int number, double x, double map_x) {
    FramePackage p;
    slam::FrameResult& r = p.result;
    r.utime = 1'000'000 + number * 100'000;
    r.sequence = number;
    r.state = slam::State::kTracking;
    r.has_pose = true;
    r.quality = 80;
    r.reset_counter = 1;
    r.T_odom_body.t.x() = x;
    r.T_map_body.t.x() = map_x;
    r.map_from_odom.t.x() = map_x - x;
    return p;
  }
  const FrameOutput& report(FramePackage p) { return reporter_.report(&p, {}); }

  Config config_ = config();
  test::KeptMessages kept_;
  test::KeptFrames first_, second_;
  Publisher publisher_;
  MapBoard maps_{config_};
  FrameReporter reporter_{
      config_, {"build", "config", "calibration"}, {&first_, &second_}, &publisher_, &maps_, 4321, true};
};

TEST_F(FrameReporterTest, TheStatusDescribesTheCameraOfALiveRun) {
  report(package(0, 0, 0));
  status_t s = kept_.of<status_t>(ipc::kStatusChannel).back();
  EXPECT_EQ(s.camera + s.camera_format, "") << "a replay";
  EXPECT_EQ(s.camera_exposure_us, -1);
  reporter_.set_camera("usb:1-1");
  FramePackage next = package(20, 0, 0);
  next.camera = {drivers::CameraFormat::kYuyv, 29.97, 4500, 12.0F};
  report(next);
  s = kept_.of<status_t>(ipc::kStatusChannel).back();
  EXPECT_EQ(s.camera, "usb:1-1");
  EXPECT_EQ(s.camera_format, "YUYV");
  EXPECT_EQ(s.camera_rate_hz, 29.97);
  EXPECT_EQ(s.camera_exposure_us, 4500);
  EXPECT_EQ(s.camera_gain, 12.0);
}

TEST_F(FrameReporterTest, HandsEachFrameOnceToEverySinkAndThePublisher) {
  for (int i = 0; i < 5; ++i) report(package(i, i, i));
  for (const test::KeptFrames* sink : {&first_, &second_}) {
    ASSERT_EQ(sink->frames.size(), 5U);
    for (int i = 0; i < 5; ++i) EXPECT_EQ(sink->frames[static_cast<std::size_t>(i)].result.sequence, i);
  }
  const auto odometry = kept_.of<odometry_t>(ipc::kOdometryChannel);
  ASSERT_EQ(odometry.size(), 5U);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(odometry[static_cast<std::size_t>(i)].sequence, i);
  EXPECT_EQ(kept_.of<timing_t>(ipc::kTimingChannel).size(), 5U);
}

TEST_F(FrameReporterTest, TheStatusComesAtItsRateAndAtEachChangeOfState) {
  for (int i = 0; i < 10; ++i) report(package(i, i, i));
  EXPECT_EQ(kept_.of<status_t>(ipc::kStatusChannel).size(), 1U);
  FramePackage lost = package(10, 10, 10);
  lost.result.utime -= 50'000;  // before the next one is due
  lost.result.state = slam::State::kLost;
  lost.result.has_pose = false;
  report(lost);
  const auto status = kept_.of<status_t>(ipc::kStatusChannel);
  ASSERT_EQ(status.size(), 2U);
  EXPECT_EQ(status[1].state, std::int8_t{status_t::STATE_LOST});
  EXPECT_EQ(status[1].frames_tracked, 11);
  EXPECT_EQ(status[1].frames_valid, 10);
  EXPECT_EQ(status[1].memory_pool_bytes, 4321);
  EXPECT_EQ(status[1].build, "build");
}

TEST_F(FrameReporterTest, TheStatusSaysWhyNoPoseIsValid) {
  FramePackage p = package(0, 0, 0);
  p.result.state = slam::State::kInitialising;
  p.result.refusal = {slam::Reason::kLittleParallax, 0.004, 0.0175};
  report(p);
  const auto status = kept_.of<status_t>(ipc::kStatusChannel);
  ASSERT_EQ(status.size(), 1U);
  EXPECT_EQ(status[0].reason, static_cast<int>(ipc::Reason::kLittleParallax));
  EXPECT_EQ(status[0].reason_value, 0.004);
  EXPECT_EQ(status[0].reason_wanted, 0.0175);
  EXPECT_EQ(status[0].message, "waiting for sideways motion: 0.0040 of 0.0175 rad");
}

TEST_F(FrameReporterTest, TheStatusHasTheCountsOfEstimatorMappingAndInput) {
  FramePackage p = package(0, 0, 0);
  p.counts.maps = 3, p.counts.lost = 2, p.counts.keyframes_dropped = 4;
  p.counts.keyframes = 50, p.counts.landmarks = 600, p.counts.mapping.vmp_alive = 70;
  p.counts.imu = {100, 2, 1}, p.counts.wheels = {10, 5, 6};
  p.counts.mapping.calibration_contradicted = true;
  p.in.images = 9, p.in.imu_invalid = 8, p.in.wheels_invalid = 7;
  p.chance.capture_queue = 3;
  report(p);
  const auto status = kept_.of<status_t>(ipc::kStatusChannel);
  ASSERT_EQ(status.size(), 1U);
  const status_t& s = status[0];
  EXPECT_EQ(s.maps, 3);
  EXPECT_EQ(s.times_lost, 2);
  EXPECT_EQ(s.keyframes_dropped, 4);
  EXPECT_EQ(s.keyframes, 50);
  EXPECT_EQ(s.landmarks, 600);
  EXPECT_EQ(s.vmps, 70);
  EXPECT_EQ(s.imu_used, 100);
  EXPECT_EQ(s.imu_late, 2);
  EXPECT_EQ(s.imu_dropped, 1);
  EXPECT_EQ(s.wheels_used, 10);
  EXPECT_EQ(s.wheels_late, 5);
  EXPECT_EQ(s.wheels_dropped, 6);
  EXPECT_EQ(s.frames_received, 9);
  EXPECT_EQ(s.imu_invalid, 8);
  EXPECT_EQ(s.wheels_invalid, 7);
  EXPECT_EQ(s.capture_queue, 3);
  EXPECT_NE(s.message, "");
}

TEST_F(FrameReporterTest, TheStatusHasTheCountsOfTheOutputs) {
  FramePackage p = package(0, 0, 0);
  OutputCounts out;
  out.can_send_errors = 2, out.can_received = 3, out.can_not_logged = 4;
  out.side_missing = 1 << static_cast<int>(SideFunction::kRecording) | 1, out.side_failures = 6;
  reporter_.report(&p, out);
  const auto status = kept_.of<status_t>(ipc::kStatusChannel);
  ASSERT_EQ(status.size(), 1U);
  EXPECT_EQ(status[0].can_send_errors, 2);
  EXPECT_EQ(status[0].can_received, 3);
  EXPECT_EQ(status[0].log_write_errors, 4);
  EXPECT_EQ(status[0].side_missing,
            std::int32_t{status_t::SIDE_RECORDING} + std::int32_t{status_t::SIDE_LCM});
  EXPECT_EQ(status[0].side_failures, 6);
}

TEST_F(FrameReporterTest, TheScheduleSaysWhatTheFrameTookAndMet) {
  FramePackage p = package(0, 0, 0);
  p.result.taken = {7, 70, 700};
  p.result.view_sequence = 5, p.result.job = 6;
  p.counts.imu.dropped = 1, p.counts.wheels.dropped = 2;
  p.chance = {11, 12, 13, 14, 15};
  report(p);
  const auto schedule = kept_.of<schedule_t>(ipc::kScheduleChannel);
  ASSERT_EQ(schedule.size(), 1U);
  const schedule_t& s = schedule[0];
  EXPECT_EQ(s.utime, p.result.utime);
  EXPECT_EQ(s.replies_taken, 7);
  EXPECT_EQ(s.imu_taken, 70);
  EXPECT_EQ(s.wheels_taken, 700);
  EXPECT_EQ(s.samples_dropped, 3);
  EXPECT_EQ(s.view_sequence, 5);
  EXPECT_EQ(s.job, 6);
  EXPECT_EQ(s.frames_dropped, 11);
  EXPECT_EQ(s.age_us, 12);
  EXPECT_EQ(s.capture_queue, 13);
  EXPECT_EQ(s.publish_queue, 14);
  EXPECT_EQ(s.features_asked, 15);
}

TEST_F(FrameReporterTest, AResetMakesTheNextPoseTheOriginOfOdomAndLeavesTheMap) {
  report(package(0, 5.0, 7.0));
  reporter_.reset_odom();
  const slam::FrameResult at_reset = report(package(1, 6.0, 8.0)).result;
  EXPECT_NEAR(at_reset.T_odom_body.t.x(), 0.0, 1e-12);
  EXPECT_EQ(at_reset.reset_counter, 2U);
  const slam::FrameResult after = report(package(2, 6.5, 8.5)).result;
  EXPECT_NEAR(after.T_odom_body.t.x(), 0.5, 1e-12);
  EXPECT_NEAR((after.map_from_odom * after.T_odom_body.t).x(), 8.5, 1e-12);
  EXPECT_EQ(after.reset_counter, 2U);
}

TEST_F(FrameReporterTest, WithoutCameraNoPoseIsSentAndTheStatusSaysWhy) {
  report(package(0, 5.0, 7.0));
  reporter_.report_silence(9'000'000, 3'000'000, {}, {});
  ASSERT_EQ(first_.frames.size(), 2U);
  EXPECT_FALSE(first_.frames[1].valid);
  EXPECT_FALSE(first_.frames[1].result.has_pose);
  EXPECT_EQ(first_.frames[1].result.state, slam::State::kNoCamera);
  const auto status = kept_.of<status_t>(ipc::kStatusChannel);
  EXPECT_EQ(status.back().state, std::int8_t{status_t::STATE_NO_CAMERA});
  EXPECT_EQ(status.back().frames_tracked, 1) << "silence is no frame";
}

TEST_F(FrameReporterTest, AFrameOlderThanTheDeadlineIsCounted) {
  FramePackage late = package(0, 0, 0);
  late.chance.age_us = 50'001;
  report(late);
  const auto status = kept_.of<status_t>(ipc::kStatusChannel);
  ASSERT_EQ(status.size(), 1U);
  EXPECT_EQ(status[0].deadlines_missed, 1);
}

}  // namespace
}  // namespace farpoint::daemon
