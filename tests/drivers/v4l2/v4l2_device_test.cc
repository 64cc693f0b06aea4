// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/v4l2_device.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/drivers/camera/live_camera_fixture.h"
#include "tests/drivers/v4l2/fake_v4l2.h"

namespace farpoint::test {

INSTANTIATE_TEST_SUITE_P(V4l2, LiveCameraTest, testing::Values(&make_fake<FakeV4l2>));

}  // namespace farpoint::test

namespace farpoint::drivers {
namespace {

using Kind = CameraEvent::Kind;
using V4l2DeviceTest = test::LiveCameraFixture<test::FakeV4l2>;

// ---- negotiation

TEST_F(V4l2DeviceTest, TheRateIsAskedFor) {
  options_.rate_hz = 25;
  start();
  EXPECT_NEAR(fake_->set_rate_hz, 25.0, 0.01);
  EXPECT_NEAR(events_[0].rate_hz, 25.0, 0.01);
}

TEST_F(V4l2DeviceTest, AFormatThatReachesTheRateBeatsACheaperOne) {
  // As USB 2 cameras are: raw images slowly, JPEG at full rate.
  fake_->formats = {CameraFormat::kYuyv, CameraFormat::kMjpeg};
  fake_->fastest_hz[CameraFormat::kYuyv] = 10;
  start();
  EXPECT_EQ(fake_->configured, CameraFormat::kMjpeg);
}

TEST_F(V4l2DeviceTest, WhereNoneReachesTheRateTheFastestIsTaken) {
  fake_->formats = {CameraFormat::kGrey, CameraFormat::kYuyv};
  fake_->fastest_hz = {{CameraFormat::kGrey, 5}, {CameraFormat::kYuyv, 15}};
  start();
  EXPECT_EQ(fake_->configured, CameraFormat::kYuyv);
}

TEST_F(V4l2DeviceTest, ADriverThatChangesTheSizeIsRefused) {
  fake_->takes_other_size = true;
  make();
  EXPECT_FALSE(next());
  EXPECT_EQ(kinds(), std::vector{Kind::kRefused});
}

TEST_F(V4l2DeviceTest, ANodeThatGivesNoImagesIsRefused) {
  fake_->capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  make();
  EXPECT_FALSE(next());
  EXPECT_EQ(kinds(), std::vector{Kind::kRefused});
}

// ---- time

TEST_F(V4l2DeviceTest, EndOfFrameStampsBecomeMidExposure) {
  options_.readout_s = 0.010;
  options_.exposure.mode = ExposureMode::kManual;
  options_.exposure.manual_us = 4000;
  fake_->give_exposure_and_gain();
  start();
  const std::int64_t stamp_us = fake_->now.monotonic_us;
  ASSERT_TRUE(show(0));
  ASSERT_TRUE(next());
  EXPECT_EQ(frame_.utime, stamp_us - 5000 - 2000);
  EXPECT_EQ(frame_.exposure_us, 4000);
}

TEST_F(V4l2DeviceTest, StartOfExposureStampsAndWhatUvcMakesOfThem) {
  options_.readout_s = 0.010;
  options_.time_offset_us = 300;
  options_.exposure.mode = ExposureMode::kManual;
  options_.exposure.manual_us = 4000;
  fake_->control_ranges[V4L2_CID_EXPOSURE_ABSOLUTE] = {1, 1000};  // the only control
  fake_->flags |= V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  for (const bool uvc : {false, true}) {
    fake_->driver = uvc ? "uvcvideo" : "fake";
    start();
    const std::int64_t stamp_us = fake_->now.monotonic_us;
    ASSERT_TRUE(show(0));
    ASSERT_TRUE(next());
    EXPECT_EQ(frame_.utime, stamp_us + 300 + 5000 + (uvc ? -2000 : 2000));
  }
}

TEST_F(V4l2DeviceTest, TheStampOfALoopbackDeviceIsTheImagesTimeAlready) {
  options_.readout_s = 0.010;
  fake_->flags = V4L2_BUF_FLAG_TIMESTAMP_COPY;
  fake_->now = {10'000'000, 5'000'000'000, 1'700'000'000'000'000};
  start();
  for (const auto clock :
       {&ClockReadings::monotonic_us, &ClockReadings::boottime_us, &ClockReadings::realtime_us}) {
    fake_->pass(33'000);
    const std::int64_t expected_us = fake_->now.monotonic_us;
    ASSERT_TRUE(fake_->show({.stamp_us = fake_->now.*clock}));
    ASSERT_TRUE(next());
    EXPECT_EQ(frame_.utime, expected_us);
  }
}

TEST_F(V4l2DeviceTest, SecondsThatNoMicrosecondsCanHoldGiveTheTimeOfArrival) {
  start();
  for (const std::int64_t stamp_s :
       {std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::min()}) {
    fake_->pass(33'000);
    fake_->stamp_s = stamp_s;
    ASSERT_TRUE(show(static_cast<std::uint32_t>(frame_.sequence + 1)));
    ASSERT_TRUE(next());
    EXPECT_NEAR(static_cast<double>(frame_.utime), static_cast<double>(fake_->now.monotonic_us), 2000.0);
  }
  EXPECT_EQ(camera_->counts().times_unknown, 2);
}

// ---- coming and going

TEST_F(V4l2DeviceTest, WhatWasMappedIsUnmapped) {
  start();
  for (int round = 0; round < 10; ++round) {
    fake_->unplug();
    EXPECT_FALSE(next());
    fake_->plugged = true;
    wait_for_stream();
    EXPECT_EQ(fake_->mapped, fake_->unmapped + options_.buffers);
  }
  camera_.reset();
  EXPECT_EQ(fake_->mapped, 11 * options_.buffers);
  EXPECT_EQ(fake_->mapped, fake_->unmapped);
}

// ---- exposure

TEST_F(V4l2DeviceTest, TheRateDoesNotPayForTheExposure) {
  fake_->give_exposure_and_gain();
  fake_->control_ranges[V4L2_CID_EXPOSURE_AUTO_PRIORITY] = {0, 1};
  for (const ExposureMode mode : {ExposureMode::kAuto, ExposureMode::kManual, ExposureMode::kCamera}) {
    fake_->controls[V4L2_CID_EXPOSURE_AUTO_PRIORITY] = 1;
    options_.exposure.mode = mode;
    start();
    EXPECT_EQ(fake_->controls[V4L2_CID_EXPOSURE_AUTO_PRIORITY], 0);
    EXPECT_EQ(fake_->controls[V4L2_CID_EXPOSURE_AUTO],
              mode == ExposureMode::kCamera ? V4L2_EXPOSURE_AUTO : V4L2_EXPOSURE_MANUAL);
  }
}

TEST_F(V4l2DeviceTest, AnExposureIsSetWhereNothingElseCanBe) {
  options_.exposure.mode = ExposureMode::kManual;
  options_.exposure.manual_us = 2000;
  fake_->control_ranges[V4L2_CID_EXPOSURE_ABSOLUTE] = {1, 500};
  start();
  EXPECT_EQ(fake_->exposure_us, 2000.0);
  EXPECT_FALSE(fake_->gain);
}

}  // namespace
}  // namespace farpoint::drivers
