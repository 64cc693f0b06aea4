#include "drivers/v4l2_device.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "drivers/live_camera.h"
#include "tests/drivers/fake_v4l2.h"
#include "tests/ipc/allocations.h"
#include "tests/ipc/jpeg_images.h"

namespace farpoint::drivers {
namespace {

using Kind = CameraEvent::Kind;
using test::fake_frame;
using test::FakeCamera;
using test::FakeFrame;
using test::plain_jpeg;

constexpr int kTimeout_ms = 20;

class V4l2CameraTest : public testing::Test {
 protected:
  V4l2CameraTest() : fake_(std::make_shared<FakeCamera>()) {
    options_.device = "/dev/null";  // exists; the fake opens nothing else
    options_.width_px = 64;
    options_.height_px = 48;
    options_.rate_hz = 30;
    options_.exposure.mode = ExposureMode::kCamera;
  }

  void make() {
    camera_ = std::make_unique<LiveCamera>(
        options_, std::make_unique<V4l2Device>(options_, std::make_unique<test::FakeV4l2System>(fake_)),
        std::make_unique<test::FakeV4l2Wait>(fake_));
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
  void show(std::uint32_t sequence, std::uint8_t grey = 100) {
    fake_->frames.push_back(fake_frame(*fake_, sequence, grey));
  }
  [[nodiscard]] std::vector<Kind> kinds() const {
    std::vector<Kind> all;
    for (const CameraEvent& e : events_) all.push_back(e.kind);
    return all;
  }

  std::shared_ptr<FakeCamera> fake_;
  CameraOptions options_;
  std::unique_ptr<LiveCamera> camera_;
  std::vector<CameraEvent> events_;
  ipc::GreyImage image_;
  CameraFrame frame_;
};

// ---- negotiation

TEST_F(V4l2CameraTest, OfEqualRatesTheCheapestFormatIsTaken) {
  fake_->formats = {{V4L2_PIX_FMT_MJPEG}, {V4L2_PIX_FMT_YUYV}, {V4L2_PIX_FMT_NV12}, {V4L2_PIX_FMT_GREY}};
  start();
  EXPECT_EQ(fake_->set.pixelformat, V4L2_PIX_FMT_GREY);
  EXPECT_NEAR(fake_->set_rate_hz, 30.0, 0.01);
  ASSERT_EQ(kinds(), std::vector{Kind::kStreaming});
  EXPECT_EQ(events_[0].format, CameraFormat::kGrey);
}

TEST_F(V4l2CameraTest, AFormatThatReachesTheRateBeatsACheaperOne) {
  // As USB 2 cameras are: raw images slowly, JPEG at full rate.
  fake_->formats = {{V4L2_PIX_FMT_YUYV, 64, 48, 10}, {V4L2_PIX_FMT_MJPEG, 64, 48, 30}};
  start();
  EXPECT_EQ(fake_->set.pixelformat, V4L2_PIX_FMT_MJPEG);
}

TEST_F(V4l2CameraTest, WhereNoneReachesTheRateTheFastestIsTaken) {
  fake_->formats = {{V4L2_PIX_FMT_GREY, 64, 48, 5}, {V4L2_PIX_FMT_YUYV, 64, 48, 15}};
  start();
  EXPECT_EQ(fake_->set.pixelformat, V4L2_PIX_FMT_YUYV);
}

TEST_F(V4l2CameraTest, AWantedFormatIsTakenOrNothing) {
  fake_->formats = {{V4L2_PIX_FMT_GREY}, {V4L2_PIX_FMT_YUYV}};
  options_.format = CameraFormat::kYuyv;
  start();
  EXPECT_EQ(fake_->set.pixelformat, V4L2_PIX_FMT_YUYV);
  options_.format = CameraFormat::kNv12;
  make();
  EXPECT_FALSE(next());
  EXPECT_FALSE(camera_->is_streaming());
}

TEST_F(V4l2CameraTest, ACameraOfAnotherSizeIsRefusedAndTheReasonSaidOnce) {
  fake_->formats = {{V4L2_PIX_FMT_GREY, 128, 96}};
  make();
  for (int i = 0; i < 50; ++i) EXPECT_FALSE(next());
  EXPECT_EQ(kinds(), std::vector{Kind::kRefused});
  EXPECT_NE(std::strstr(events_[0].what, "calibration's size"), nullptr);
  EXPECT_EQ(fake_->opened, fake_->closed);
}

TEST_F(V4l2CameraTest, ADriverThatChangesTheSizeIsRefused) {
  fake_->takes_other_size = true;
  make();
  EXPECT_FALSE(next());
  EXPECT_EQ(kinds(), std::vector{Kind::kRefused});
}

TEST_F(V4l2CameraTest, ANodeThatGivesNoImagesIsRefused) {
  fake_->capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  make();
  EXPECT_FALSE(next());
  EXPECT_EQ(kinds(), std::vector{Kind::kRefused});
}

// ---- frames

TEST_F(V4l2CameraTest, ImagesComeOnceInOrderWithTheirContent) {
  start();
  for (std::uint32_t i = 0; i < 20; ++i) {
    show(i, static_cast<std::uint8_t>(i));
    ASSERT_TRUE(next());
    EXPECT_EQ(frame_.sequence, i);
    EXPECT_EQ(image_.width_px, 64);
    EXPECT_TRUE(std::all_of(image_.pixels.begin(), image_.pixels.end(),
                            [i](int p) { return p == static_cast<int>(i); }));
    EXPECT_EQ(fake_->buffers_queued(), options_.buffers);  // given back at once
  }
  EXPECT_EQ(camera_->counts().frames, 20);
  EXPECT_EQ(camera_->counts().missing, 0);
  EXPECT_FALSE(next());
}

TEST_F(V4l2CameraTest, PaddedRowsAndYuyv) {
  fake_->formats = {{V4L2_PIX_FMT_YUYV, 64, 48, 30, 32}};
  start();
  FakeFrame frame = fake_frame(*fake_, 0);
  const std::size_t stride = 64 * 2 + 32;
  for (std::size_t y = 0; y < 48; ++y)
    for (std::size_t x = 0; x < 64; ++x) frame.bytes[y * stride + 2 * x] = static_cast<std::uint8_t>(x + y);
  fake_->frames.push_back(frame);
  ASSERT_TRUE(next());
  for (std::size_t y = 0; y < 48; ++y)
    for (std::size_t x = 0; x < 64; ++x) ASSERT_EQ(image_.pixels[y * 64 + x], x + y);
}

TEST_F(V4l2CameraTest, GapsInTheSequenceAreCountedAndKept) {
  start();
  for (const std::uint32_t sequence : {0U, 1U, 4U, 5U}) {
    show(sequence);
    ASSERT_TRUE(next());
  }
  EXPECT_EQ(frame_.sequence, 5);
  EXPECT_EQ(camera_->counts().missing, 2);
}

TEST_F(V4l2CameraTest, FlaggedBuffersAreDroppedCountedAndGivenBack) {
  start();
  show(0);
  show(1);
  fake_->frames[0].flags |= V4L2_BUF_FLAG_ERROR;
  EXPECT_FALSE(next());
  EXPECT_TRUE(next());
  EXPECT_EQ(frame_.sequence, 1);
  EXPECT_EQ(camera_->counts().flagged, 1);
  EXPECT_EQ(camera_->counts().missing, 0);
  EXPECT_EQ(fake_->buffers_queued(), options_.buffers);
}

TEST_F(V4l2CameraTest, ShortImagesAndBadJpegsAreDroppedAndCounted) {
  start();
  show(0);
  fake_->frames[0].bytes.resize(64 * 48 - 1);
  EXPECT_FALSE(next());
  EXPECT_EQ(camera_->counts().undecodable, 1);

  fake_->formats = {{V4L2_PIX_FMT_MJPEG}};
  start();
  show(0);  // no JPEG
  EXPECT_FALSE(next());
  EXPECT_EQ(camera_->counts().undecodable, 1);
}

TEST_F(V4l2CameraTest, MjpegIsDecoded) {
  fake_->formats = {{V4L2_PIX_FMT_MJPEG}};
  start();
  show(0);
  fake_->frames[0].bytes = plain_jpeg(64, 48, 77);
  ASSERT_TRUE(next());
  EXPECT_EQ(image_.pixels[1000], 77);
  show(1);
  fake_->frames[0].bytes = plain_jpeg(32, 48, 77);  // not the size that was agreed upon
  EXPECT_FALSE(next());
  EXPECT_EQ(camera_->counts().undecodable, 1);
}

TEST_F(V4l2CameraTest, NoHeapCallAfterTheFirstImages) {
  if (!test::counts_allocations()) GTEST_SKIP() << "a sanitizer owns the heap";
  fake_->formats = {{V4L2_PIX_FMT_MJPEG}};
  start();
  const auto jpeg = plain_jpeg(64, 48, 77);
  constexpr std::uint32_t kWarm = 3, kFrames = 50;
  for (std::uint32_t i = 0; i < kFrames; ++i) {
    show(i);
    fake_->frames[i].bytes = jpeg;
    fake_->frames[i].stamp_us += i;
  }
  for (std::uint32_t i = 0; i < kWarm; ++i) ASSERT_TRUE(next());
  const auto before = test::allocations();
  for (std::uint32_t i = kWarm; i < kFrames; ++i) ASSERT_TRUE(next());
  EXPECT_EQ(test::allocations() - before, 0U);
}

// ---- time

TEST_F(V4l2CameraTest, EndOfFrameStampsBecomeMidExposure) {
  options_.stamp_point = StampPoint::kAuto;
  options_.readout_s = 0.010;
  options_.exposure.mode = ExposureMode::kManual;
  options_.exposure.manual_us = 4000;
  fake_->control_ranges[V4L2_CID_EXPOSURE_AUTO] = {0, 3};
  fake_->control_ranges[V4L2_CID_EXPOSURE_ABSOLUTE] = {1, 1000};
  start();
  show(0);
  const std::int64_t stamp_us = fake_->frames[0].stamp_us;
  ASSERT_TRUE(next());
  EXPECT_EQ(frame_.utime, stamp_us - 5000 - 2000);
  EXPECT_EQ(frame_.exposure_us, 4000);
}

TEST_F(V4l2CameraTest, StartOfExposureStampsAndWhatUvcMakesOfThem) {
  options_.readout_s = 0.010;
  options_.time_offset_us = 300;
  options_.exposure.mode = ExposureMode::kManual;
  options_.exposure.manual_us = 4000;
  fake_->control_ranges[V4L2_CID_EXPOSURE_ABSOLUTE] = {1, 1000};
  for (const bool uvc : {false, true}) {
    fake_->driver = uvc ? "uvcvideo" : "fake";
    start();
    show(0);
    fake_->frames[0].flags |= V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
    const std::int64_t stamp_us = fake_->frames[0].stamp_us;
    ASSERT_TRUE(next());
    EXPECT_EQ(frame_.utime, stamp_us + 300 + 5000 + (uvc ? -2000 : 2000));
  }
}

TEST_F(V4l2CameraTest, OtherClocksAreToldAndTranslated) {
  fake_->now = {10'000'000, 5'000'000'000, 1'700'000'000'000'000};
  start();
  for (const auto clock :
       {&ClockReadings::monotonic_us, &ClockReadings::boottime_us, &ClockReadings::realtime_us}) {
    pass(33'000);
    show(static_cast<std::uint32_t>(frame_.sequence + 1));
    fake_->frames[0].stamp_us = fake_->now.*clock;
    fake_->frames[0].flags = V4L2_BUF_FLAG_TIMESTAMP_COPY;
    const std::int64_t expected_us = fake_->now.monotonic_us;
    ASSERT_TRUE(next());
    EXPECT_EQ(frame_.utime, expected_us);
  }
  EXPECT_EQ(camera_->counts().times_unknown, 0);
}

TEST_F(V4l2CameraTest, ASystemTimeThatJumpsMovesNoImage) {
  start();
  std::int64_t last = 0;
  for (std::uint32_t i = 0; i < 6; ++i) {
    show(i);
    ASSERT_TRUE(next());
    if (i > 0) {
      EXPECT_NEAR(static_cast<double>(frame_.utime - last), 33'000.0, 2000.0);
    }
    last = frame_.utime;
    fake_->now.monotonic_us += 32'000;
    fake_->now.boottime_us += 32'000;
    fake_->now.realtime_us += i == 2 ? 3'600'000'000 : i == 4 ? -3'600'000'000 : 32'000;
  }
}

TEST_F(V4l2CameraTest, AStampOfNoClockGivesTheTimeOfArrivalAndIsCounted) {
  start();
  show(0);
  fake_->frames[0].stamp_us = 42;
  ASSERT_TRUE(next());
  EXPECT_NEAR(static_cast<double>(frame_.utime), static_cast<double>(fake_->now.monotonic_us), 2000.0);
  EXPECT_EQ(camera_->counts().times_unknown, 1);
}

TEST_F(V4l2CameraTest, ATimeThatIsNotLaterIsDroppedAndCounted) {
  start();
  show(0);
  show(1);
  fake_->frames[1].stamp_us = fake_->frames[0].stamp_us;
  EXPECT_TRUE(next());
  EXPECT_FALSE(next());
  EXPECT_EQ(camera_->counts().times_backwards, 1);
}

// ---- coming and going

TEST_F(V4l2CameraTest, AnAbsentCameraIsWaitedForWithBackOff) {
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

TEST_F(V4l2CameraTest, UnpluggedAndPluggedInTenTimes) {
  start();
  std::uint32_t sequence = 0;
  for (int round = 0; round < 10; ++round) {
    for (std::uint32_t i = 0; i < 5; ++i) {
      show(i);
      ASSERT_TRUE(next()) << round;
      EXPECT_EQ(frame_.sequence, sequence++);  // goes on although the driver's starts anew
    }
    fake_->plugged = false;
    fake_->frames.clear();
    for (int i = 0; i < 20; ++i) EXPECT_FALSE(next());
    EXPECT_FALSE(camera_->is_streaming());
    fake_->plugged = true;
    for (int i = 0; i < 60 && !camera_->is_streaming(); ++i) EXPECT_FALSE(next());
    ASSERT_TRUE(camera_->is_streaming());
  }
  EXPECT_EQ(camera_->counts().lost, 10);
  EXPECT_EQ(camera_->counts().opened, 11);
  EXPECT_EQ(camera_->counts().missing, 0);
  EXPECT_EQ(fake_->opened, fake_->closed + 1);
  EXPECT_EQ(fake_->mapped, fake_->unmapped + options_.buffers);
}

TEST_F(V4l2CameraTest, AStreamThatFailsIsStartedAnew) {
  start();
  show(0);
  EXPECT_TRUE(next());
  fake_->stream_error = EIO;
  EXPECT_FALSE(next());
  for (int i = 0; i < 20 && !camera_->is_streaming(); ++i) EXPECT_FALSE(next());
  EXPECT_EQ(kinds(), (std::vector{Kind::kStreaming, Kind::kLost, Kind::kStreaming}));
  EXPECT_EQ(events_[1].error, EIO);
  show(0);
  EXPECT_TRUE(next());
}

TEST_F(V4l2CameraTest, ACameraThatStopsWithoutAnErrorIsStartedAnew) {
  options_.stall_s = 0.5;
  start();
  show(0);
  EXPECT_TRUE(next());
  const int streams = fake_->streams;
  for (int i = 0; i < 40; ++i) EXPECT_FALSE(next());  // 0.8 s
  EXPECT_EQ(camera_->counts().stalled, 1);
  EXPECT_GT(fake_->streams, streams);
  EXPECT_EQ(kinds(), (std::vector{Kind::kStreaming, Kind::kStalled, Kind::kStreaming}));
}

// ---- exposure

TEST_F(V4l2CameraTest, AutomaticExposureGetsBrighterInTheDarkShortestFirst) {
  options_.exposure.mode = ExposureMode::kAuto;
  options_.exposure.short_us = 4000;
  options_.exposure.max_us = 16000;
  fake_->control_ranges[V4L2_CID_EXPOSURE_AUTO] = {0, 3};
  fake_->control_ranges[V4L2_CID_EXPOSURE_AUTO_PRIORITY] = {0, 1};
  fake_->controls[V4L2_CID_EXPOSURE_AUTO_PRIORITY] = 1;
  fake_->control_ranges[V4L2_CID_EXPOSURE_ABSOLUTE] = {1, 500};
  fake_->control_ranges[V4L2_CID_GAIN] = {0, 100};
  start();
  EXPECT_EQ(fake_->controls[V4L2_CID_EXPOSURE_AUTO], V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(fake_->controls[V4L2_CID_EXPOSURE_AUTO_PRIORITY], 0);  // the rate is not to suffer
  EXPECT_EQ(fake_->controls[V4L2_CID_EXPOSURE_ABSOLUTE], 40);
  bool gain_before_long_exposure = true;
  for (std::uint32_t i = 0; i < 80; ++i) {
    pass(33'000);
    show(i, 10);
    ASSERT_TRUE(next());
    const bool long_exposure = fake_->controls[V4L2_CID_EXPOSURE_ABSOLUTE] > 40;
    if (long_exposure && fake_->controls[V4L2_CID_GAIN] < 100) gain_before_long_exposure = false;
  }
  EXPECT_TRUE(gain_before_long_exposure);
  EXPECT_EQ(fake_->controls[V4L2_CID_GAIN], 100);
  EXPECT_EQ(fake_->controls[V4L2_CID_EXPOSURE_ABSOLUTE], 160);
  for (std::uint32_t i = 80; i < 200; ++i) {
    pass(33'000);
    show(i, 255);
    ASSERT_TRUE(next());
  }
  EXPECT_EQ(fake_->controls[V4L2_CID_GAIN], 0);
  EXPECT_EQ(fake_->controls[V4L2_CID_EXPOSURE_ABSOLUTE], 1);
}

TEST_F(V4l2CameraTest, ExposureChangesWhileStreaming) {
  options_.exposure.mode = ExposureMode::kManual;
  options_.exposure.manual_us = 2000;
  fake_->control_ranges[V4L2_CID_EXPOSURE_ABSOLUTE] = {1, 500};
  start();
  EXPECT_EQ(fake_->controls[V4L2_CID_EXPOSURE_ABSOLUTE], 20);
  ExposureOptions other = options_.exposure;
  other.manual_us = 9000;
  camera_->set_exposure(other);
  show(0);
  EXPECT_TRUE(next());
  EXPECT_EQ(fake_->controls[V4L2_CID_EXPOSURE_ABSOLUTE], 90);
}

TEST_F(V4l2CameraTest, ACameraWithoutControlsStillStreams) {
  options_.exposure.mode = ExposureMode::kAuto;
  start();
  show(0);
  EXPECT_TRUE(next());
  EXPECT_EQ(frame_.exposure_us, -1);
  EXPECT_FALSE(events_[0].exposure_known);
}

}  // namespace
}  // namespace farpoint::drivers
