// SPDX-License-Identifier: Apache-2.0
// A log as a live camera, on the real clock: times are exact, however late the machine is.
#include "drivers/log/log_camera.h"

#include <gtest/gtest.h>
#include <poll.h>

#include <string>
#include <thread>
#include <vector>

#include "drivers/camera/live_camera.h"
#include "ipc/channels.h"
#include "tests/ipc/scratch.h"

namespace farpoint::drivers {
namespace {

constexpr int kWidth = 8, kHeight = 4;
constexpr std::int64_t kPeriod_us = 5'000;

class LogCameraTest : public testing::Test {
 protected:
  LogCameraTest() {
    options_.device = scratch_.path("run.lcm");
    options_.width_px = kWidth;
    options_.height_px = kHeight;
    options_.buffers = 16;
  }
  // Image i has the grey level i and the time `utimes[i]`.
  void write_log(const std::vector<std::int64_t>& utimes, int width_px = kWidth, int channel = 0) {
    ipc::LogWriter log(options_.device);
    image_t image{};
    image.camera = channel;
    image.width = width_px;
    image.height = kHeight;
    image.pixel_format = image_t::PIXEL_FORMAT_GREY;
    image.size = width_px * kHeight;
    image.exposure_us = 1500;
    image.gain = 2.0F;
    for (std::size_t i = 0; i < utimes.size(); ++i) {
      image.utime = utimes[i];
      image.sequence = static_cast<std::int64_t>(i);
      image.data.assign(static_cast<std::size_t>(image.size), static_cast<std::uint8_t>(i));
      log.write_message(ipc::kCameraChannelPrefix + std::to_string(channel), image.utime, image);
    }
    log.close();
  }
  void write_steady_log(int images) {
    std::vector<std::int64_t> utimes;
    for (int i = 0; i < images; ++i) utimes.push_back(900 + kPeriod_us * i);
    write_log(utimes);
  }
  void open() {
    camera_ = std::make_unique<LiveCamera>(options_, std::make_unique<LogCamera>(options_));
    camera_->on_event([this](const CameraEvent& event) { events_.push_back(event); });
  }
  // The next image, waited for.
  bool next() {
    for (int i = 0; i < 200; ++i)
      if (camera_->next(50, &image_, &frame_)) return true;
    return false;
  }

  const test::Scratch scratch_;
  CameraOptions options_;
  std::unique_ptr<LiveCamera> camera_;
  std::vector<CameraEvent> events_;
  ipc::GreyImage image_;
  CameraFrame frame_;
};

TEST_F(LogCameraTest, ImagesComeWithoutEndAtTheRecordingsStepsAndNeverBeforeTheyAreDue) {
  write_steady_log(10);
  open();
  std::int64_t last_us = 0, last_sequence = 0;
  for (int i = 0; i < 35; ++i) {
    ASSERT_TRUE(next()) << i;
    EXPECT_LE(frame_.utime, read_clocks().monotonic_us);
    if (i > 0) {
      // A machine that is too late skips whole images.
      EXPECT_EQ((frame_.utime - last_us) % kPeriod_us, 0);
      EXPECT_EQ((frame_.utime - last_us) / kPeriod_us, frame_.sequence - last_sequence);
    }
    EXPECT_EQ(int{image_.pixels[5]}, static_cast<int>(frame_.sequence % 10));
    last_us = frame_.utime;
    last_sequence = frame_.sequence;
  }
  EXPECT_EQ(frame_.exposure_us, 1500);
  EXPECT_EQ(frame_.gain, 2.0F);
  EXPECT_EQ(camera_->counts().times_unknown, 0);
  EXPECT_EQ(camera_->counts().times_backwards, 0);
  EXPECT_EQ(events_.size(), 1U);
}

TEST_F(LogCameraTest, UnevenStepsAreKept) {
  write_log({100, 3'100, 10'100, 14'100, 30'100});
  open();
  std::vector<std::int64_t> utimes;
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(next());
    utimes.push_back(frame_.utime);
  }
  if (camera_->counts().missing > 0) GTEST_SKIP() << "a machine too busy for 3 ms";
  EXPECT_EQ(utimes[1] - utimes[0], 3'000);
  EXPECT_EQ(utimes[2] - utimes[1], 7'000);
  EXPECT_EQ(utimes[4] - utimes[3], 16'000);
}

TEST_F(LogCameraTest, AReaderThatWasHeldUpSkipsWhatACameraCouldNotHaveBuffered) {
  options_.buffers = 2;
  write_steady_log(1000);
  open();
  ASSERT_TRUE(next());
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  ASSERT_TRUE(next());  // was ready before the pause
  ASSERT_TRUE(next());
  EXPECT_GE(camera_->counts().missing, 40);
  EXPECT_GT(frame_.utime, read_clocks().monotonic_us - 200'000);
  EXPECT_EQ(int{image_.pixels[0]}, static_cast<int>((frame_.sequence) % 256));
}

TEST_F(LogCameraTest, AGapLongerThanAStallIsCutShortAndTheLogGoesOn) {
  options_.stall_s = 0.1;
  write_log({0, 5'000, 10'000, 60'000'000, 60'005'000});
  open();
  std::vector<int> shown;
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(next());
    shown.push_back(image_.pixels[0]);
  }
  EXPECT_EQ(shown, (std::vector{0, 1, 2, 3, 4}));
  EXPECT_EQ(camera_->counts().stalled, 1);
}

TEST_F(LogCameraTest, ALogThatIsNotThereIsAnAbsentCameraAndMayCome) {
  open();
  EXPECT_FALSE(camera_->next(1, &image_, &frame_));
  ASSERT_EQ(events_.size(), 1U);
  EXPECT_EQ(events_[0].kind, CameraEvent::Kind::kAbsent);
  write_steady_log(5);
  EXPECT_TRUE(next());
}

TEST_F(LogCameraTest, ALogWithoutAnImageForThisCameraIsRefused) {
  const auto is_refused = [this] {
    open();
    events_.clear();
    EXPECT_FALSE(camera_->next(1, &image_, &frame_));
    return !events_.empty() && events_[0].kind == CameraEvent::Kind::kRefused;
  };
  write_log({100, 200, 300}, kWidth, 1);  // another channel
  EXPECT_TRUE(is_refused());
  write_log({100, 200, 300}, kWidth + 1);
  EXPECT_TRUE(is_refused());
  write_log({});
  EXPECT_TRUE(is_refused());
}

}  // namespace
}  // namespace farpoint::drivers
