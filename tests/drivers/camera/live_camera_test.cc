// SPDX-License-Identifier: Apache-2.0
// What every camera driver promises; drivers bring their fake camera (live_camera_fixture.h).
#include "drivers/camera/live_camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <limits>

#include "tests/drivers/camera/live_camera_fixture.h"
#include "tests/ipc/allocations.h"
#include "tests/ipc/jpeg_images.h"

namespace farpoint::test {

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(LiveCameraTest);  // a build may have no driver

namespace {

using drivers::CameraFormat;
using drivers::ClockReadings;
using drivers::ExposureMode;
using drivers::ExposureOptions;
using Kind = drivers::CameraEvent::Kind;

constexpr std::int64_t kPeriod_us = 33'000;

// ---- negotiation

TEST_P(LiveCameraTest, TheCheapestFormatIsTaken) {
  fake_->formats = {CameraFormat::kMjpeg, CameraFormat::kRgb24, CameraFormat::kYuyv, CameraFormat::kNv12,
                    CameraFormat::kGrey};
  for (const CameraFormat cheapest : {CameraFormat::kGrey, CameraFormat::kNv12, CameraFormat::kYuyv,
                                      CameraFormat::kRgb24, CameraFormat::kMjpeg}) {
    start();
    EXPECT_EQ(fake_->configured, cheapest);
    ASSERT_EQ(kinds(), std::vector{Kind::kStreaming});
    EXPECT_EQ(events_[0].format, cheapest);
    fake_->formats.pop_back();
  }
}

TEST_P(LiveCameraTest, AWantedFormatIsTakenOrNothing) {
  fake_->formats = {CameraFormat::kGrey, CameraFormat::kYuyv};
  options_.format = CameraFormat::kYuyv;
  start();
  EXPECT_EQ(fake_->configured, CameraFormat::kYuyv);
  options_.format = CameraFormat::kNv12;
  make();
  EXPECT_FALSE(next());
  EXPECT_FALSE(camera_->is_streaming());
}

TEST_P(LiveCameraTest, ACameraOfAnotherSizeIsRefusedAndTheReasonSaidOnce) {
  fake_->width_px = 60;
  make();
  for (int i = 0; i < 50; ++i) EXPECT_FALSE(next());
  EXPECT_EQ(kinds(), std::vector{Kind::kRefused});
  EXPECT_NE(std::strstr(events_[0].what, "calibration's size"), nullptr);
  EXPECT_GT(fake_->opened, 1);
  EXPECT_EQ(fake_->opened, fake_->closed);
}

// ---- frames

TEST_P(LiveCameraTest, ImagesComeOnceInOrderWithTheirContent) {
  start();
  for (std::uint32_t i = 0; i < 20; ++i) {
    ASSERT_TRUE(show(i, static_cast<std::uint8_t>(i)));
    ASSERT_TRUE(next());
    EXPECT_EQ(frame_.sequence, i);
    EXPECT_EQ(image_.width_px, 64);
    EXPECT_TRUE(
        std::all_of(image_.pixels.begin(), image_.pixels.end(), [i](std::uint8_t p) { return p == i; }));
    EXPECT_EQ(fake_->buffers_queued(), options_.buffers);  // given back at once
  }
  EXPECT_EQ(camera_->counts().frames, 20);
  EXPECT_EQ(camera_->counts().missing, 0);
  EXPECT_FALSE(next());
}

TEST_P(LiveCameraTest, ImagesThatPileUpAreAllTaken) {
  start();
  for (std::uint32_t i = 0; i < 4; ++i) {
    fake_->pass(1000);
    ASSERT_TRUE(show(i, static_cast<std::uint8_t>(10 * i)));
  }
  EXPECT_FALSE(show(4));  // no buffer is queued
  for (std::uint32_t i = 0; i < 4; ++i) {
    ASSERT_TRUE(next());
    EXPECT_EQ(image_.pixels[0], 10 * i);
  }
  EXPECT_FALSE(next());
}

TEST_P(LiveCameraTest, PaddedRowsOfEachFormat) {
  fake_->stride_padding = 32;
  for (const CameraFormat format : {CameraFormat::kGrey, CameraFormat::kNv12, CameraFormat::kYuyv}) {
    fake_->formats = {format};
    start();
    const std::size_t step = format == CameraFormat::kYuyv ? 2 : 1, stride = 64 * step + 32;
    std::vector<std::uint8_t> bytes(stride * 48, std::uint8_t{255});
    for (std::size_t y = 0; y < 48; ++y)
      for (std::size_t x = 0; x < 64; ++x) bytes[y * stride + step * x] = static_cast<std::uint8_t>(x + y);
    ASSERT_TRUE(fake_->show({.bytes = bytes}));
    ASSERT_TRUE(next());
    for (std::size_t y = 0; y < 48; ++y)
      for (std::size_t x = 0; x < 64; ++x) ASSERT_EQ(image_.pixels[y * 64 + x], x + y);
  }
}

TEST_P(LiveCameraTest, ColoursBecomeTheirLuma) {
  fake_->formats = {CameraFormat::kRgb24};
  fake_->stride_padding = 32;
  start();
  struct Case {
    std::array<std::uint8_t, 3> rgb;
    int grey;  // 0.299 R + 0.587 G + 0.114 B
  };
  std::uint32_t sequence = 0;
  for (const Case& c : {Case{{255, 255, 255}, 255}, Case{{0, 0, 0}, 0}, Case{{255, 0, 0}, 76},
                        Case{{0, 255, 0}, 150}, Case{{0, 0, 255}, 29}, Case{{10, 200, 90}, 131}}) {
    constexpr std::size_t kStride = 3 * 64 + 32;
    std::vector<std::uint8_t> bytes(kStride * 48, std::uint8_t{255});
    for (std::size_t y = 0; y < 48; ++y)
      for (std::size_t x = 0; x < 64; ++x) std::copy_n(c.rgb.data(), 3, bytes.data() + y * kStride + 3 * x);
    fake_->pass(1000);
    ASSERT_TRUE(fake_->show({.sequence = sequence++, .bytes = bytes}));
    ASSERT_TRUE(next());
    for (const std::uint8_t p : image_.pixels) ASSERT_NEAR(p, c.grey, 1);
  }
}

TEST_P(LiveCameraTest, MjpegIsDecodedAndWhatIsNoneOrOfAnotherSizeIsCounted) {
  fake_->formats = {CameraFormat::kMjpeg};
  start();
  ASSERT_TRUE(fake_->show({.bytes = plain_jpeg(64, 48, 77)}));
  ASSERT_TRUE(next());
  EXPECT_EQ(image_.pixels[1000], 77);
  fake_->pass(1000);
  ASSERT_TRUE(fake_->show({.sequence = 1, .bytes = plain_jpeg(32, 48, 77)}));
  EXPECT_FALSE(next());
  EXPECT_EQ(camera_->counts().undecodable, 1);
  fake_->pass(1000);
  ASSERT_TRUE(show(2));  // no JPEG
  EXPECT_FALSE(next());
  EXPECT_EQ(camera_->counts().undecodable, 2);
}

TEST_P(LiveCameraTest, ShortImagesAreDroppedAndCounted) {
  start();
  ASSERT_TRUE(fake_->show({.bytes = std::vector<std::uint8_t>(64 * 48 - 1)}));
  EXPECT_FALSE(next());
  EXPECT_EQ(camera_->counts().undecodable, 1);
  EXPECT_EQ(fake_->buffers_queued(), options_.buffers);
}

TEST_P(LiveCameraTest, GapsInTheSequenceAreCountedAndKeptWhereverItStarts) {
  for (const std::uint32_t first : {0U, 7U}) {
    start();
    for (const std::uint32_t step : {0U, 1U, 4U, 5U}) {
      ASSERT_TRUE(show(first + step));
      ASSERT_TRUE(next());
    }
    EXPECT_EQ(frame_.sequence, 5);
    EXPECT_EQ(camera_->counts().missing, 2);
  }
}

TEST_P(LiveCameraTest, DamagedFramesAreDroppedCountedAndGivenBack) {
  start();
  ASSERT_TRUE(fake_->show({.sequence = 0, .damaged = true}));
  ASSERT_TRUE(show(1));
  EXPECT_FALSE(next());
  EXPECT_TRUE(next());
  EXPECT_EQ(frame_.sequence, 1);
  EXPECT_EQ(camera_->counts().flagged, 1);
  EXPECT_EQ(camera_->counts().missing, 0);
  EXPECT_EQ(fake_->buffers_queued(), options_.buffers);
}

TEST_P(LiveCameraTest, NoHeapCallWhileItStreams) {
  if (!counts_allocations()) GTEST_SKIP() << "a sanitizer owns the heap";
  fake_->give_exposure_and_gain();
  options_.exposure.mode = ExposureMode::kAuto;
  for (const CameraFormat format : {CameraFormat::kGrey, CameraFormat::kMjpeg}) {
    fake_->formats = {format};
    start();
    constexpr std::uint32_t kWarm = 3, kFrames = 60;
    FakeShot dark{.grey = 10};
    if (format == CameraFormat::kMjpeg) dark.bytes = plain_jpeg(64, 48, 10);
    for (; dark.sequence < kWarm; ++dark.sequence) {
      ASSERT_TRUE(fake_->show(dark));
      ASSERT_TRUE(next());
    }
    const auto first_gain = fake_->gain;
    const auto before = allocations();
    std::uint32_t shown = 0, taken = 0;
    for (; dark.sequence < kFrames; ++dark.sequence) {
      fake_->pass(kPeriod_us);
      shown += fake_->show(dark) ? 1 : 0;
      taken += next() ? 1 : 0;
    }
    EXPECT_EQ(allocations() - before, 0U);
    EXPECT_EQ(shown, kFrames - kWarm);
    EXPECT_EQ(taken, shown);
    EXPECT_GT(fake_->gain, first_gain);  // the exposure did move
  }
}

// ---- time

constexpr std::array kClocks = {&ClockReadings::monotonic_us, &ClockReadings::boottime_us,
                                &ClockReadings::realtime_us};

TEST_P(LiveCameraTest, OtherClocksAreToldAndTranslated) {
  fake_->now = {10'000'000, 5'000'000'000, 1'700'000'000'000'000};
  start();
  for (const auto clock : kClocks) {
    fake_->pass(kPeriod_us);
    ASSERT_TRUE(fake_->show(
        {.sequence = static_cast<std::uint32_t>(frame_.sequence + 1), .stamp_us = fake_->now.*clock}));
    const std::int64_t expected_us = fake_->now.monotonic_us;
    ASSERT_TRUE(next());
    EXPECT_EQ(frame_.utime, expected_us);
  }
  EXPECT_EQ(camera_->counts().times_unknown, 0);
}

TEST_P(LiveCameraTest, ASystemTimeThatJumpsMovesNoImage) {
  for (const auto clock : kClocks) {
    start();
    std::int64_t last = 0;
    for (std::uint32_t i = 0; i < 6; ++i) {
      ASSERT_TRUE(fake_->show({.sequence = i, .stamp_us = fake_->now.*clock}));
      ASSERT_TRUE(next());
      if (i > 0) {
        EXPECT_NEAR(static_cast<double>(frame_.utime - last), double{kPeriod_us}, 2000.0);
      }
      last = frame_.utime;
      fake_->pass(kPeriod_us - 1000);
      fake_->now.realtime_us += i == 2 ? 3'600'000'000 : i == 4 ? -3'600'000'000 : 0;
    }
    EXPECT_EQ(camera_->counts().times_unknown, 0);
  }
}

TEST_P(LiveCameraTest, AStampOfNoClockGivesTheTimeOfArrivalAndIsCounted) {
  start();
  constexpr std::int64_t kHuge = std::numeric_limits<std::int64_t>::max();
  for (const std::int64_t stamp_us : {std::int64_t{0}, std::int64_t{42}, std::int64_t{-1}, -kHuge, kHuge,
                                      std::int64_t{0x5DEECE66DABCDEF}}) {
    fake_->pass(kPeriod_us);
    ASSERT_TRUE(fake_->show({.stamp_us = stamp_us}));
    ASSERT_TRUE(next());
    EXPECT_NEAR(static_cast<double>(frame_.utime), static_cast<double>(fake_->now.monotonic_us), 2000.0);
  }
  EXPECT_EQ(camera_->counts().times_unknown, 6);
}

// Stamps that are late by up to 1.9 s, in no order.
TEST_P(LiveCameraTest, StampsThatJitterCostAFewImagesThenTheTimeOfArrivalStandsInUntilTheNextStream) {
  start();
  constexpr std::uint32_t kFrames = 135;
  std::uint32_t random = 1, taken = 0;
  std::int64_t last = 0;
  for (std::uint32_t i = 0; i < kFrames; ++i) {
    fake_->pass(kPeriod_us);
    random = 1664525 * random + 1013904223;
    ASSERT_TRUE(fake_->show({.sequence = i, .stamp_us = fake_->now.monotonic_us - random % 1'900'000}));
    if (!next()) continue;
    ++taken;
    EXPECT_GT(frame_.utime, last);
    last = frame_.utime;
  }
  EXPECT_GE(taken, kFrames - 8);
  EXPECT_EQ(camera_->counts().times_backwards, kFrames - taken);
  EXPECT_GE(camera_->counts().times_unknown, kFrames - 32);
  const std::int64_t unknown = camera_->counts().times_unknown;
  fake_->fail_stream();
  EXPECT_FALSE(next());
  for (int i = 0; i < 20 && !camera_->is_streaming(); ++i) EXPECT_FALSE(next());
  ASSERT_TRUE(show(0));
  EXPECT_TRUE(next());
  EXPECT_EQ(camera_->counts().times_unknown, unknown);
}

TEST_P(LiveCameraTest, ImagesThatComeTwiceCastNoDoubtOnTheStamps) {
  start();
  for (std::uint32_t i = 0; i < 20; ++i) {
    fake_->pass(kPeriod_us);
    const std::int64_t stamp_us = fake_->now.monotonic_us;
    ASSERT_TRUE(fake_->show({.sequence = 2 * i, .stamp_us = stamp_us}));
    ASSERT_TRUE(fake_->show({.sequence = 2 * i + 1, .stamp_us = stamp_us}));
    EXPECT_TRUE(next());
    EXPECT_FALSE(next());
  }
  EXPECT_EQ(camera_->counts().times_backwards, 20);
  EXPECT_EQ(camera_->counts().times_unknown, 0);
}

TEST_P(LiveCameraTest, ATimeThatIsNotLaterIsDroppedAndCounted) {
  start();
  ASSERT_TRUE(show(0));
  ASSERT_TRUE(show(1));
  EXPECT_TRUE(next());
  EXPECT_FALSE(next());
  EXPECT_EQ(camera_->counts().times_backwards, 1);
}

// ---- coming and going

TEST_P(LiveCameraTest, AnAbsentCameraIsWaitedForWithBackOff) {
  fake_->plugged = false;
  make();
  for (int i = 0; i < 200; ++i) EXPECT_FALSE(next());
  EXPECT_EQ(kinds(), std::vector{Kind::kAbsent});  // said once
  fake_->plugged = true;
  wait_for_stream();
  // Never longer than asked for, and never a busy loop.
  EXPECT_LE(*std::max_element(fake_->waits_ms.begin(), fake_->waits_ms.end()), kTimeout_ms);
  EXPECT_GT(*std::min_element(fake_->waits_ms.begin(), fake_->waits_ms.end()), 0);
}

TEST_P(LiveCameraTest, UnpluggedAndPluggedInTenTimes) {
  start();
  std::uint32_t sequence = 0;
  for (int round = 0; round < 10; ++round) {
    for (std::uint32_t i = 0; i < 5; ++i) {
      ASSERT_TRUE(show(i));
      ASSERT_TRUE(next()) << round;
      EXPECT_EQ(frame_.sequence, sequence++);  // goes on although the driver's starts anew
    }
    fake_->unplug();
    EXPECT_FALSE(next());
    EXPECT_FALSE(camera_->is_streaming());  // at once
    for (int i = 0; i < 20; ++i) EXPECT_FALSE(next());
    EXPECT_FALSE(camera_->is_streaming());
    fake_->plugged = true;
    wait_for_stream();
  }
  EXPECT_EQ(camera_->counts().lost, 10);
  EXPECT_EQ(camera_->counts().opened, 11);
  EXPECT_EQ(camera_->counts().missing, 0);
  EXPECT_EQ(camera_->counts().flagged, 0);
  EXPECT_EQ(fake_->opened, fake_->closed + 1);
}

TEST_P(LiveCameraTest, AStreamThatFailsIsALossAndStartedAnew) {
  start();
  ASSERT_TRUE(show(0));
  EXPECT_TRUE(next());
  fake_->fail_stream();
  EXPECT_FALSE(next());
  EXPECT_EQ(camera_->counts().lost, 1);
  for (int i = 0; i < 20 && !camera_->is_streaming(); ++i) EXPECT_FALSE(next());
  EXPECT_EQ(kinds(), (std::vector{Kind::kStreaming, Kind::kLost, Kind::kStreaming}));
  EXPECT_EQ(events_[1].error, EIO);
  ASSERT_TRUE(show(0));
  EXPECT_TRUE(next());
}

TEST_P(LiveCameraTest, ABufferThatIsNotTakenBackIsALossButItsImageCounts) {
  start();
  fake_->give_back_error = ENODEV;
  ASSERT_TRUE(show(0));
  EXPECT_TRUE(next());
  EXPECT_FALSE(camera_->is_streaming());
  EXPECT_EQ(camera_->counts().lost, 1);
  EXPECT_EQ(events_.back().kind, Kind::kLost);
  EXPECT_EQ(events_.back().error, ENODEV);
}

TEST_P(LiveCameraTest, ACameraThatStopsWithoutAnErrorIsStartedAnew) {
  options_.stall_s = 0.5;
  start();
  ASSERT_TRUE(show(0));
  EXPECT_TRUE(next());
  const int streams = fake_->streams;
  for (int i = 0; i < 40; ++i) EXPECT_FALSE(next());  // 0.8 s
  EXPECT_EQ(camera_->counts().stalled, 1);
  EXPECT_GT(fake_->streams, streams);
  EXPECT_EQ(kinds(), (std::vector{Kind::kStreaming, Kind::kStalled, Kind::kStreaming}));
}

TEST_P(LiveCameraTest, OpeningAndClosingShowWhenTheyBeganWhileTheyLast) {
  make();
  std::vector<std::int64_t> opening, closing;
  std::int64_t opened_us = 0, closed_us = 0;
  fake_->on_open = [&] {
    opened_us = fake_->now.monotonic_us;
    fake_->pass(3'000'000);
    opening.push_back(camera_->opening_since_us());
  };
  fake_->on_close = [&] {
    closed_us = fake_->now.monotonic_us;
    fake_->pass(3'000'000);
    closing.push_back(camera_->opening_since_us());
  };
  EXPECT_EQ(camera_->opening_since_us(), drivers::Camera::kNotOpening);
  EXPECT_FALSE(next());
  ASSERT_TRUE(camera_->is_streaming());
  EXPECT_EQ(opening, std::vector{opened_us});
  EXPECT_EQ(camera_->opening_since_us(), drivers::Camera::kNotOpening);
  fake_->fail_stream();
  EXPECT_FALSE(next());
  EXPECT_EQ(closing, std::vector{closed_us});
  EXPECT_EQ(camera_->opening_since_us(), drivers::Camera::kNotOpening);
  fake_->on_close = nullptr;  // the fixture's end closes too
}

// ---- exposure

TEST_P(LiveCameraTest, ManualExposureAndGainAreSetBeforeTheFirstImage) {
  fake_->give_exposure_and_gain();
  options_.exposure.mode = ExposureMode::kManual;
  options_.exposure.manual_us = 60'000;  // more than it can
  options_.exposure.manual_gain = (fake_->gain_min + fake_->gain_max) / 2;
  start();
  EXPECT_EQ(fake_->is_automatic, false);
  EXPECT_EQ(fake_->exposure_us, 50'000.0);
  EXPECT_EQ(fake_->gain, options_.exposure.manual_gain);
  EXPECT_TRUE(events_[0].exposure_known);
}

TEST_P(LiveCameraTest, ACameraWithoutControlsStillStreams) {
  options_.exposure.mode = ExposureMode::kAuto;
  start();
  ASSERT_TRUE(show(0));
  EXPECT_TRUE(next());
  EXPECT_FALSE(fake_->exposure_us || fake_->gain || fake_->is_automatic);
  EXPECT_EQ(frame_.exposure_us, -1);
  EXPECT_EQ(frame_.gain, -1.0F);
  EXPECT_FALSE(events_[0].exposure_known);
}

TEST_P(LiveCameraTest, AutomaticExposureGetsBrighterInTheDarkShortestFirst) {
  fake_->give_exposure_and_gain();
  options_.exposure.mode = ExposureMode::kAuto;
  options_.exposure.short_us = 4000;
  options_.exposure.max_us = 16000;
  start();
  EXPECT_EQ(fake_->is_automatic, false);
  EXPECT_EQ(fake_->exposure_us, 4000.0);
  bool gain_before_long_exposure = true;
  for (std::uint32_t i = 0; i < 160; ++i) {
    fake_->pass(kPeriod_us);
    ASSERT_TRUE(show(i, 10));
    ASSERT_TRUE(next());
    if (fake_->exposure_us > 4000.0 && fake_->gain < fake_->gain_max) gain_before_long_exposure = false;
  }
  EXPECT_TRUE(gain_before_long_exposure);
  EXPECT_EQ(fake_->gain, fake_->gain_max);
  EXPECT_EQ(fake_->exposure_us, 16'000.0);
  for (std::uint32_t i = 160; i < 500; ++i) {
    fake_->pass(kPeriod_us);
    ASSERT_TRUE(show(i, 255));
    ASSERT_TRUE(next());
  }
  EXPECT_EQ(fake_->gain, fake_->gain_min);
  EXPECT_EQ(fake_->exposure_us, 100.0);
}

TEST_P(LiveCameraTest, ExposureChangesWhileStreaming) {
  fake_->give_exposure_and_gain();
  options_.exposure.mode = ExposureMode::kManual;
  options_.exposure.manual_us = 2000;
  start();
  EXPECT_EQ(fake_->exposure_us, 2000.0);
  ExposureOptions other = options_.exposure;
  other.manual_us = 9000;
  camera_->set_exposure(other);
  ASSERT_TRUE(show(0));
  EXPECT_TRUE(next());
  EXPECT_EQ(fake_->exposure_us, 9000.0);
  other.mode = ExposureMode::kCamera;
  camera_->set_exposure(other);
  fake_->pass(kPeriod_us);
  ASSERT_TRUE(show(1));
  EXPECT_TRUE(next());
  EXPECT_EQ(fake_->is_automatic, true);
  EXPECT_EQ(frame_.exposure_us, -1);  // the camera's own affair now
}

}  // namespace
}  // namespace farpoint::test
