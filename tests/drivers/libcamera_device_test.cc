#include "drivers/libcamera_device.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

#include "drivers/libcamera_loader.h"
#include "drivers/live_camera.h"
#include "tests/drivers/fake_libcamera.h"
#include "tests/ipc/allocations.h"
#include "tests/ipc/jpeg_images.h"

namespace farpoint::drivers {
namespace {

using Kind = CameraEvent::Kind;
using Status = LibcameraFrame::Status;
using test::FakeLibcamera;
using test::FakeShot;

constexpr int kTimeout_ms = 20;

class LibcameraCameraTest : public testing::Test {
 protected:
  LibcameraCameraTest() {
    options_.device = "fake";
    options_.width_px = 64;
    options_.height_px = 48;
    options_.rate_hz = 30;
    options_.exposure.mode = ExposureMode::kCamera;
  }

  std::unique_ptr<LibcameraDevice> make_device() {
    return std::make_unique<LibcameraDevice>(options_, std::make_unique<test::FakeLibcameraSystem>(fake_));
  }
  void make() {
    camera_.reset();
    events_.clear();
    camera_ =
        std::make_unique<LiveCamera>(options_, make_device(), std::make_unique<test::FakeCameraWait>(fake_));
    camera_->on_event([this](const CameraEvent& event) { events_.push_back(event); });
  }
  bool next() { return camera_->next(kTimeout_ms, &image_, &frame_); }
  // Opens the camera by looking for an image that is not there.
  void start() {
    make();
    EXPECT_FALSE(next());
    ASSERT_TRUE(camera_->is_streaming());
  }
  void pass(std::int64_t us) {
    fake_->now.monotonic_us += us;
    fake_->now.boottime_us += us;
    fake_->now.realtime_us += us;
  }
  bool show(std::uint32_t sequence, std::uint8_t grey = 100) {
    FakeShot shot;
    shot.sequence = sequence;
    shot.grey = grey;
    return fake_->show(shot);
  }
  void give_controls() {
    fake_->has.has_auto_exposure = fake_->has.has_exposure = fake_->has.has_gain = true;
    fake_->has.range = {100, 50'000, 100, 1600};
  }
  [[nodiscard]] std::vector<Kind> kinds() const {
    std::vector<Kind> all;
    for (const CameraEvent& e : events_) all.push_back(e.kind);
    return all;
  }

  std::shared_ptr<FakeLibcamera> fake_ = std::make_shared<FakeLibcamera>();
  CameraOptions options_;
  std::unique_ptr<LiveCamera> camera_;
  std::vector<CameraEvent> events_;
  ipc::GreyImage image_;
  CameraFrame frame_;
};

// ---- negotiation

TEST_F(LibcameraCameraTest, TheCheapestFormatIsTaken) {
  fake_->formats = {CameraFormat::kMjpeg, CameraFormat::kYuyv, CameraFormat::kNv12, CameraFormat::kGrey};
  for (const CameraFormat cheapest :
       {CameraFormat::kGrey, CameraFormat::kNv12, CameraFormat::kYuyv, CameraFormat::kMjpeg}) {
    start();
    EXPECT_EQ(fake_->configured, cheapest);
    ASSERT_EQ(kinds(), std::vector{Kind::kStreaming});
    EXPECT_EQ(events_[0].format, cheapest);
    fake_->formats.pop_back();
  }
}

TEST_F(LibcameraCameraTest, AWantedFormatIsTakenOrNothing) {
  fake_->formats = {CameraFormat::kGrey, CameraFormat::kYuyv};
  options_.format = CameraFormat::kYuyv;
  start();
  EXPECT_EQ(fake_->configured, CameraFormat::kYuyv);
  options_.format = CameraFormat::kNv12;
  make();
  EXPECT_FALSE(next());
  EXPECT_FALSE(camera_->is_streaming());
}

TEST_F(LibcameraCameraTest, ACameraOfAnotherSizeIsRefusedAndTheReasonSaidOnce) {
  fake_->width_px = 60;
  make();
  for (int i = 0; i < 50; ++i) EXPECT_FALSE(next());
  EXPECT_EQ(kinds(), std::vector{Kind::kRefused});
  EXPECT_NE(std::strstr(events_[0].what, "calibration's size"), nullptr);
  EXPECT_GT(fake_->opened, 1);
  EXPECT_EQ(fake_->opened, fake_->closed);
}

TEST_F(LibcameraCameraTest, ACameraThatAnotherProgramHoldsIsRefused) {
  fake_->busy = true;
  make();
  EXPECT_FALSE(next());
  ASSERT_EQ(kinds(), std::vector{Kind::kRefused});
  EXPECT_EQ(events_[0].error, EBUSY);
}

TEST_F(LibcameraCameraTest, TheRateIsAskedForWhereItCanBe) {
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

TEST_F(LibcameraCameraTest, OnlyNamesThatCanBeUsed) {
  for (const char* good :
       {"0", "12", "\\_SB_.PCI0.XHC_.RHUB.HS08-8:1.0-04f2:b681", "/base/soc/i2c@1/imx219@10"})
    EXPECT_EQ(LibcameraDevice::check(good), "") << good;
  for (const char* bad : {"", "/dev/video0", "by-id:cam", "usb:1-2"})
    EXPECT_NE(LibcameraDevice::check(bad).find("expected its id"), std::string::npos) << bad;
}

// ---- frames

TEST_F(LibcameraCameraTest, ImagesComeOnceInOrderWithTheirContent) {
  start();
  EXPECT_EQ(fake_->device, "fake");
  for (std::uint32_t i = 0; i < 20; ++i) {
    ASSERT_TRUE(show(i, static_cast<std::uint8_t>(i)));
    ASSERT_TRUE(next());
    EXPECT_EQ(frame_.sequence, i);
    EXPECT_EQ(image_.width_px, 64);
    EXPECT_TRUE(std::all_of(image_.pixels.begin(), image_.pixels.end(), [i](int p) { return p == int(i); }));
    EXPECT_EQ(fake_->requests_queued(), fake_->requests);  // queued again at once
  }
  EXPECT_EQ(camera_->counts().frames, 20);
  EXPECT_EQ(camera_->counts().missing, 0);
  EXPECT_FALSE(next());
}

TEST_F(LibcameraCameraTest, ImagesThatPileUpAreAllTaken) {
  start();
  for (std::uint32_t i = 0; i < 4; ++i) {
    pass(1000);
    ASSERT_TRUE(show(i, static_cast<std::uint8_t>(10 * i)));
  }
  EXPECT_FALSE(show(4));  // none is queued
  for (std::uint32_t i = 0; i < 4; ++i) {
    ASSERT_TRUE(next());
    EXPECT_EQ(image_.pixels[0], 10 * i);
  }
  EXPECT_FALSE(next());
}

TEST_F(LibcameraCameraTest, PaddedRowsOfEachFormat) {
  fake_->stride_padding = 32;
  for (const CameraFormat format : {CameraFormat::kGrey, CameraFormat::kNv12, CameraFormat::kYuyv}) {
    fake_->formats = {format};
    start();
    const std::size_t step = format == CameraFormat::kYuyv ? 2 : 1, stride = 64 * step + 32;
    FakeShot shot;
    shot.bytes.emplace(stride * 48, std::uint8_t{255});
    for (std::size_t y = 0; y < 48; ++y)
      for (std::size_t x = 0; x < 64; ++x)
        (*shot.bytes)[y * stride + step * x] = static_cast<std::uint8_t>(x + y);
    ASSERT_TRUE(fake_->show(shot));
    ASSERT_TRUE(next());
    for (std::size_t y = 0; y < 48; ++y)
      for (std::size_t x = 0; x < 64; ++x) ASSERT_EQ(image_.pixels[y * 64 + x], x + y);
  }
}

TEST_F(LibcameraCameraTest, MjpegIsDecodedAndWhatIsNoneIsCounted) {
  fake_->formats = {CameraFormat::kMjpeg};
  start();
  FakeShot shot;
  shot.bytes = test::plain_jpeg(64, 48, 77);
  ASSERT_TRUE(fake_->show(shot));
  ASSERT_TRUE(next());
  EXPECT_NEAR(image_.pixels[1000], 77, 1);
  pass(1000);
  ASSERT_TRUE(show(1));
  EXPECT_FALSE(next());
  EXPECT_EQ(camera_->counts().undecodable, 1);
}

TEST_F(LibcameraCameraTest, ShortImagesAreDroppedAndCounted) {
  start();
  FakeShot shot;
  shot.bytes.emplace(64 * 48 - 1);
  ASSERT_TRUE(fake_->show(shot));
  EXPECT_FALSE(next());
  EXPECT_EQ(camera_->counts().undecodable, 1);
  EXPECT_EQ(fake_->requests_queued(), fake_->requests);
}

TEST_F(LibcameraCameraTest, GapsInTheSequenceAreCountedAndKept) {
  start();
  for (const std::uint32_t sequence : {7U, 8U, 11U, 12U}) {
    ASSERT_TRUE(show(sequence));
    ASSERT_TRUE(next());
  }
  EXPECT_EQ(frame_.sequence, 5);
  EXPECT_EQ(camera_->counts().missing, 2);
}

TEST_F(LibcameraCameraTest, DamagedFramesAreDroppedCountedAndGivenBack) {
  start();
  FakeShot damaged;
  damaged.status = Status::kDamaged;
  ASSERT_TRUE(fake_->show(damaged));
  EXPECT_FALSE(next());
  ASSERT_TRUE(show(1));
  EXPECT_TRUE(next());
  EXPECT_EQ(camera_->counts().flagged, 1);
  EXPECT_EQ(camera_->counts().missing, 0);
  EXPECT_EQ(fake_->requests_queued(), fake_->requests);
}

TEST_F(LibcameraCameraTest, NoHeapCallWhileItStreams) {
  if (!test::counts_allocations()) GTEST_SKIP() << "a sanitizer owns the heap";
  give_controls();
  options_.exposure.mode = ExposureMode::kAuto;
  start();
  constexpr std::uint32_t kWarm = 3, kFrames = 60;
  for (std::uint32_t i = 0; i < kWarm; ++i) {
    ASSERT_TRUE(show(i, 10));
    ASSERT_TRUE(next());
  }
  const auto before = test::allocations();
  int shown = 0, taken = 0;
  for (std::uint32_t i = kWarm; i < kFrames; ++i) {
    pass(33'000);
    shown += show(i, 10) ? 1 : 0;
    taken += next() ? 1 : 0;
  }
  EXPECT_EQ(test::allocations() - before, 0U);
  EXPECT_EQ(shown, int(kFrames - kWarm));
  EXPECT_EQ(taken, shown);
  EXPECT_GT(fake_->settings.size(), 2U);  // the exposure did move
}

// ---- time

TEST_F(LibcameraCameraTest, StampsAreOfTheStartOfReadoutUnlessToldOtherwise) {
  give_controls();
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
  // What the camera reports of the frame is believed rather than what was asked for.
  pass(33'000);
  stamp_us = fake_->now.monotonic_us;
  FakeShot shot;
  shot.exposure_us = 3000;
  shot.gain = 250;
  ASSERT_TRUE(fake_->show(shot));
  ASSERT_TRUE(next());
  EXPECT_EQ(frame_.utime, stamp_us + 300 + 5000 - 1500);
  EXPECT_EQ(frame_.exposure_us, 3000);
  EXPECT_EQ(frame_.gain, 250.0F);
  options_.stamp_point = StampPoint::kEndOfFrame;
  start();
  stamp_us = fake_->now.monotonic_us;
  ASSERT_TRUE(show(0));
  ASSERT_TRUE(next());
  EXPECT_EQ(frame_.utime, stamp_us + 300 - 5000 - 2000);
}

TEST_F(LibcameraCameraTest, OtherClocksAreToldAndTranslated) {
  fake_->now = {10'000'000, 5'000'000'000, 1'700'000'000'000'000};
  start();
  for (const auto clock :
       {&ClockReadings::monotonic_us, &ClockReadings::boottime_us, &ClockReadings::realtime_us}) {
    pass(33'000);
    FakeShot shot;
    shot.sequence = static_cast<std::uint32_t>(frame_.sequence + 1);
    shot.stamp_us = fake_->now.*clock;
    ASSERT_TRUE(fake_->show(shot));
    const std::int64_t expected_us = fake_->now.monotonic_us;
    ASSERT_TRUE(next());
    EXPECT_EQ(frame_.utime, expected_us);
  }
  EXPECT_EQ(camera_->counts().times_unknown, 0);
}

TEST_F(LibcameraCameraTest, AStampOfNoClockGivesTheTimeOfArrivalAndIsCounted) {
  start();
  FakeShot shot;
  shot.stamp_us = 0;
  ASSERT_TRUE(fake_->show(shot));
  ASSERT_TRUE(next());
  EXPECT_NEAR(static_cast<double>(frame_.utime), static_cast<double>(fake_->now.monotonic_us), 2000.0);
  EXPECT_EQ(camera_->counts().times_unknown, 1);
}

TEST_F(LibcameraCameraTest, ATimeThatIsNotLaterIsDroppedAndCounted) {
  start();
  ASSERT_TRUE(show(0));
  ASSERT_TRUE(show(1));
  EXPECT_TRUE(next());
  EXPECT_FALSE(next());
  EXPECT_EQ(camera_->counts().times_backwards, 1);
}

// ---- coming and going

TEST_F(LibcameraCameraTest, AnAbsentCameraIsWaitedForWithBackOff) {
  fake_->plugged = false;
  make();
  for (int i = 0; i < 200; ++i) EXPECT_FALSE(next());
  EXPECT_EQ(kinds(), std::vector{Kind::kAbsent});  // said once
  fake_->plugged = true;
  for (int i = 0; i < 60 && !camera_->is_streaming(); ++i) EXPECT_FALSE(next());
  EXPECT_TRUE(camera_->is_streaming());  // within 60 * 20 ms
  // Never longer than asked for, and never a busy loop.
  EXPECT_LE(*std::max_element(fake_->waits_ms.begin(), fake_->waits_ms.end()), kTimeout_ms);
  EXPECT_GT(*std::min_element(fake_->waits_ms.begin(), fake_->waits_ms.end()), 0);
}

TEST_F(LibcameraCameraTest, RemovedAndBackTenTimes) {
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
    fake_->plugged = true;
    for (int i = 0; i < 60 && !camera_->is_streaming(); ++i) EXPECT_FALSE(next());
    ASSERT_TRUE(camera_->is_streaming());
  }
  EXPECT_EQ(camera_->counts().lost, 10);
  EXPECT_EQ(camera_->counts().opened, 11);
  EXPECT_EQ(camera_->counts().missing, 0);
  EXPECT_EQ(camera_->counts().flagged, 0);
  EXPECT_EQ(fake_->opened, fake_->closed + 1);
}

TEST_F(LibcameraCameraTest, CancelledRequestsAreALossAndItIsStartedAnew) {
  start();
  ASSERT_TRUE(show(0));
  EXPECT_TRUE(next());
  FakeShot cancelled;
  cancelled.status = Status::kCancelled;
  ASSERT_TRUE(fake_->show(cancelled));
  EXPECT_FALSE(next());
  for (int i = 0; i < 20 && !camera_->is_streaming(); ++i) EXPECT_FALSE(next());
  EXPECT_EQ(kinds(), (std::vector{Kind::kStreaming, Kind::kLost, Kind::kStreaming}));
  EXPECT_EQ(events_[1].error, EIO);
  ASSERT_TRUE(show(0));
  EXPECT_TRUE(next());
}

TEST_F(LibcameraCameraTest, ARequestThatIsNotTakenBackIsALossButItsImageCounts) {
  start();
  fake_->queue_error = ENODEV;
  ASSERT_TRUE(show(0));
  EXPECT_TRUE(next());
  EXPECT_FALSE(camera_->is_streaming());
  EXPECT_EQ(camera_->counts().lost, 1);
  EXPECT_EQ(events_.back().error, ENODEV);
}

TEST_F(LibcameraCameraTest, ACameraThatStopsWithoutAnErrorIsStartedAnew) {
  options_.stall_s = 0.5;
  start();
  ASSERT_TRUE(show(0));
  EXPECT_TRUE(next());
  const int starts = fake_->starts;
  for (int i = 0; i < 40; ++i) EXPECT_FALSE(next());  // 0.8 s
  EXPECT_EQ(camera_->counts().stalled, 1);
  EXPECT_GT(fake_->starts, starts);
  EXPECT_EQ(kinds(), (std::vector{Kind::kStreaming, Kind::kStalled, Kind::kStreaming}));
}

// ---- exposure

TEST_F(LibcameraCameraTest, ManualExposureAndGainAreSetBeforeTheFirstImage) {
  give_controls();
  options_.exposure.mode = ExposureMode::kManual;
  options_.exposure.manual_us = 60'000;  // more than it can
  options_.exposure.manual_gain = 250;
  start();
  ASSERT_EQ(fake_->settings.size(), 1U);
  EXPECT_EQ(fake_->settings[0].auto_exposure, false);
  EXPECT_EQ(fake_->settings[0].exposure_us, 50'000);
  EXPECT_EQ(fake_->settings[0].gain, 250);
  EXPECT_TRUE(events_[0].exposure_known);
}

TEST_F(LibcameraCameraTest, ACameraWithoutControlsStillStreams) {
  options_.exposure.mode = ExposureMode::kAuto;
  start();
  ASSERT_TRUE(show(0));
  EXPECT_TRUE(next());
  EXPECT_TRUE(fake_->settings.empty());
  EXPECT_EQ(frame_.exposure_us, -1);
  EXPECT_EQ(frame_.gain, -1.0F);
  EXPECT_FALSE(events_[0].exposure_known);
}

TEST_F(LibcameraCameraTest, AutomaticExposureGetsBrighterInTheDarkShortestFirst) {
  give_controls();
  options_.exposure.mode = ExposureMode::kAuto;
  options_.exposure.short_us = 4000;
  options_.exposure.max_us = 16000;
  start();
  ASSERT_EQ(fake_->settings.size(), 1U);
  EXPECT_EQ(fake_->settings[0].auto_exposure, false);
  EXPECT_EQ(fake_->settings[0].exposure_us, 4000);
  bool gain_before_long_exposure = true;
  std::size_t changes = fake_->settings.size();
  std::uint32_t changed_at = 0;
  for (std::uint32_t i = 0; i < 160; ++i) {
    pass(33'000);
    ASSERT_TRUE(show(i, 10));
    ASSERT_TRUE(next());
    const LibcameraSetting& last = fake_->settings.back();
    if (last.exposure_us > 4000 && last.gain < 1600) gain_before_long_exposure = false;
    if (fake_->settings.size() == changes) continue;
    // Not before images that were queued with the last setting have come.
    EXPECT_GE(i - changed_at, std::uint32_t(fake_->requests)) << i;
    changes = fake_->settings.size();
    changed_at = i;
  }
  EXPECT_TRUE(gain_before_long_exposure);
  EXPECT_EQ(fake_->settings.back().gain, 1600);
  EXPECT_EQ(fake_->settings.back().exposure_us, 16'000);
  for (std::uint32_t i = 160; i < 500; ++i) {
    pass(33'000);
    ASSERT_TRUE(show(i, 255));
    ASSERT_TRUE(next());
  }
  EXPECT_EQ(fake_->settings.back().gain, 100);
  EXPECT_EQ(fake_->settings.back().exposure_us, 100);
}

TEST_F(LibcameraCameraTest, ExposureChangesWhileStreaming) {
  give_controls();
  options_.exposure.mode = ExposureMode::kManual;
  options_.exposure.manual_us = 2000;
  start();
  ExposureOptions other = options_.exposure;
  other.manual_us = 9000;
  camera_->set_exposure(other);
  ASSERT_TRUE(show(0));
  EXPECT_TRUE(next());
  EXPECT_EQ(fake_->settings.back().exposure_us, 9000);
  other.mode = ExposureMode::kCamera;
  camera_->set_exposure(other);
  pass(33'000);
  ASSERT_TRUE(show(1));
  EXPECT_TRUE(next());
  EXPECT_EQ(fake_->settings.back().auto_exposure, true);
  EXPECT_EQ(frame_.exposure_us, -1);  // the camera's own affair now
}

// ---- threads

TEST_F(LibcameraCameraTest, AStopTakesLessThanASecondWhateverTheCameraDoes) {
  for (const bool removed : {false, true}) {
    fake_->plugged = true;
    camera_ = std::make_unique<LiveCamera>(options_, make_device());
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

TEST(FinishedRequests, NoneIsLostDoubledOrOutOfOrderBetweenTwoThreads) {
  constexpr std::uint32_t kRounds = 2000, kRequests = FinishedRequests::kMaxRequests;
  FinishedRequests finished;
  std::array<std::atomic<bool>, kRequests> is_queued;
  std::array<std::uint32_t, kRequests> content{};
  for (auto& queued : is_queued) queued = true;
  std::thread signals([&] {
    for (std::uint32_t i = 0; i < kRounds; ++i) {
      const std::uint32_t request = i % kRequests;
      while (!is_queued.at(request).exchange(false)) std::this_thread::yield();
      content.at(request) = i;
      EXPECT_TRUE(finished.push(request));
    }
    finished.set_removed();
  });
  CameraWait wait;
  std::uint32_t taken = 0, request = 0;
  while (taken < kRounds) {
    wait.wait(finished.fd(), 1000);
    if (!finished.take(&request)) break;
    if (content.at(request) != taken) break;
    is_queued.at(request) = true;
    ++taken;
  }
  EXPECT_EQ(taken, kRounds);
  for (auto& queued : is_queued) queued = true;
  signals.join();
  EXPECT_TRUE(finished.was_removed());
  finished.clear();
  EXPECT_FALSE(finished.was_removed());
  EXPECT_FALSE(finished.take(&request));
}

TEST(FinishedRequests, WhatCannotBeIsNotStored) {
  FinishedRequests finished;
  EXPECT_FALSE(finished.push(FinishedRequests::kMaxRequests));
  for (std::uint32_t i = 0; i < FinishedRequests::kMaxRequests; ++i) EXPECT_TRUE(finished.push(i));
  EXPECT_FALSE(finished.push(0));
}

// ---- the module

TEST(LibcameraModule, IsFoundBesideTheProgramLoadedAndListsNoSuchCamera) {
  if (!test::counts_allocations()) GTEST_SKIP() << "a sanitizer knows nothing of libcamera's threads";
  std::string problem;
  const auto system = load_libcamera(libcamera_module_path(), &problem);
  ASSERT_NE(system, nullptr) << problem;
  FinishedRequests finished;
  for (int i = 0; i < 5; ++i) {
    const char* what = "";
    EXPECT_EQ(system->open("no such camera", &finished, &what), -ENOENT);
    EXPECT_STREQ(what, "libcamera does not list it");
    EXPECT_EQ(system->open("999", &finished, &what), -ENOENT);
  }
  system->close();
  EXPECT_FALSE(finished.was_removed());
}

TEST(LibcameraModule, OneThatIsNotThereIsNamed) {
  std::string problem;
  EXPECT_EQ(load_libcamera("/nonexistent/farpoint_libcamera.so", &problem), nullptr);
  EXPECT_NE(problem.find("/nonexistent/farpoint_libcamera.so"), std::string::npos) << problem;
  // A library, but none of Farpoint's.
  EXPECT_EQ(load_libcamera("libm.so.6", &problem), nullptr);
  EXPECT_NE(problem.find("another version"), std::string::npos) << problem;
}

}  // namespace
}  // namespace farpoint::drivers
