// SPDX-License-Identifier: Apache-2.0
#include "drivers/libcamera/libcamera_device.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <thread>

#include "tests/drivers/camera/live_camera_fixture.h"
#include "tests/drivers/libcamera/fake_libcamera.h"

namespace farpoint::test {

INSTANTIATE_TEST_SUITE_P(Libcamera, LiveCameraTest, testing::Values(&make_fake<FakeLibcamera>));

}  // namespace farpoint::test

namespace farpoint::drivers {
namespace {

using Kind = CameraEvent::Kind;
using LibcameraDeviceTest = test::LiveCameraFixture<test::FakeLibcamera>;

// ---- negotiation

TEST_F(LibcameraDeviceTest, OnlyNamesThatCanBeUsed) {
  for (const char* good :
       {"0", "12", "\\_SB_.PCI0.XHC_.RHUB.HS08-8:1.0-04f2:b681", "/base/soc/i2c@1/imx219@10"})
    EXPECT_EQ(LibcameraDevice::check(good), "") << good;
  for (const char* bad : {"", "/dev/video0", "by-id:cam", "usb:1-2"})
    EXPECT_NE(LibcameraDevice::check(bad).find("expected its id"), std::string::npos) << bad;
}

TEST_F(LibcameraDeviceTest, ACameraThatAnotherProgramHoldsIsRefused) {
  fake_->busy = true;
  make();
  EXPECT_FALSE(next());
  ASSERT_EQ(kinds(), std::vector{Kind::kRefused});
  EXPECT_EQ(events_[0].error, EBUSY);
}

TEST_F(LibcameraDeviceTest, TheRateIsAskedForWhereItCanBe) {
  options_.rate_hz = 25;
  start();
  EXPECT_TRUE(fake_->settings.empty());
  EXPECT_EQ(events_[0].rate_hz, 0.0);  // unknown
  fake_->has.has_frame_duration = true;
  start();
  ASSERT_EQ(fake_->settings.size(), 1U);
  EXPECT_EQ(fake_->settings[0].frame_duration_us, 40'000);
  EXPECT_EQ(events_[0].rate_hz, 25.0);
}

// ---- time

TEST_F(LibcameraDeviceTest, StampsAreOfTheStartOfReadoutUnlessToldOtherwise) {
  fake_->give_exposure_and_gain();
  options_.readout_s = 0.010;
  options_.time_offset_us = 300;
  options_.exposure.mode = ExposureMode::kManual;
  options_.exposure.manual_us = 4000;
  start();
  std::int64_t stamp_us = fake_->now.monotonic_us;
  ASSERT_TRUE(show(0));
  ASSERT_TRUE(next());
  EXPECT_EQ(frame_.utime, stamp_us + 300 + 5000 - 2000);
  EXPECT_EQ(frame_.exposure_us, 4000);
  options_.stamp_point = StampPoint::kEndOfFrame;
  start();
  stamp_us = fake_->now.monotonic_us;
  ASSERT_TRUE(show(0));
  ASSERT_TRUE(next());
  EXPECT_EQ(frame_.utime, stamp_us + 300 - 5000 - 2000);
}

// ---- exposure

TEST_F(LibcameraDeviceTest, WhatIsReportedOfAnImageIsBelievedRatherThanWhatWasAskedFor) {
  fake_->give_exposure_and_gain();
  options_.readout_s = 0.010;
  options_.exposure.mode = ExposureMode::kManual;
  options_.exposure.manual_us = 4000;
  start();
  fake_->reported_exposure_us = 3000;
  fake_->reported_gain = 250;
  const std::int64_t stamp_us = fake_->now.monotonic_us;
  ASSERT_TRUE(show(0));
  ASSERT_TRUE(next());
  EXPECT_EQ(frame_.utime, stamp_us + 5000 - 1500);
  EXPECT_EQ(frame_.exposure_us, 3000);
  EXPECT_EQ(frame_.gain, 250.0F);
}

TEST_F(LibcameraDeviceTest, AutomaticExposureWaitsForImagesThatWereQueuedWithItsLastSetting) {
  fake_->give_exposure_and_gain();
  options_.exposure.mode = ExposureMode::kAuto;
  start();
  ASSERT_EQ(fake_->settings.size(), 1U);  // all that is set, at the start of the stream
  EXPECT_EQ(fake_->settings[0].auto_exposure, false);
  std::size_t changes = fake_->settings.size();
  std::uint32_t changed_at = 0;
  for (std::uint32_t i = 0; i < 160; ++i) {
    fake_->pass(33'000);
    ASSERT_TRUE(show(i, 10));
    ASSERT_TRUE(next());
    if (fake_->settings.size() == changes) continue;
    EXPECT_GE(i - changed_at, std::uint32_t(fake_->requests)) << i;
    changes = fake_->settings.size();
    changed_at = i;
  }
  EXPECT_GT(changes, 2U);
}

// ---- threads

TEST_F(LibcameraDeviceTest, AStopTakesLessThanASecondWhateverTheCameraDoes) {
  for (const bool removed : {false, true}) {
    fake_->plugged = true;
    camera_ = std::make_unique<LiveCamera>(options_, fake_->make_device(options_));
    ASSERT_FALSE(camera_->next(1, &image_, &frame_));
    ASSERT_TRUE(camera_->is_streaming());
    FinishedRequests* finished = fake_->finished;
    std::atomic<bool> stop{false};
    std::thread capture([&] {
      ipc::GreyImage image;
      CameraFrame frame;
      while (!stop) EXPECT_FALSE(camera_->next(100, &image, &frame));
    });
    if (removed) finished->set_removed();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    const auto asked = std::chrono::steady_clock::now();
    stop = true;
    capture.join();
    EXPECT_EQ(camera_->counts().lost, removed ? 1 : 0);
    camera_.reset();
    EXPECT_LT(std::chrono::steady_clock::now() - asked, std::chrono::seconds(1));
    EXPECT_EQ(fake_->opened, fake_->closed);
  }
}

}  // namespace
}  // namespace farpoint::drivers
