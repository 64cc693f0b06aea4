// SPDX-License-Identifier: Apache-2.0
// The second camera and the matching of its images with the first one's, turn by turn without threads; and
// the recorder with two cameras.
#include "daemon/input/stereo_watch.h"

#include <gtest/gtest.h>

#include <deque>
#include <optional>

#include "daemon/input/camera_source.h"
#include "daemon/input/recorder.h"
#include "tests/daemon/synthetic_log.h"
#include "tests/ipc/log_events.h"
#include "tests/ipc/scratch.h"

namespace farpoint::daemon {
namespace {

constexpr std::int64_t kPeriod_us = 50'000, kTolerance_us = 5'000;
constexpr std::int64_t kPatience_us = 200'000;

// What each turn gives: a time, or nothing.
class ScriptedCamera final : public drivers::Camera {
 public:
  bool next(int, ipc::GreyImage* image, drivers::CameraFrame* frame) override {
    if (turns.empty() || !turns.front()) {
      if (!turns.empty()) turns.pop_front();
      return false;
    }
    *image = {4, 2, std::vector<std::uint8_t>(8, 7)};
    frame->utime = *turns.front();
    frame->sequence = counts_.frames++;
    turns.pop_front();
    return true;
  }
  [[nodiscard]] bool is_streaming() const override { return streaming; }
  [[nodiscard]] const drivers::CameraCounts& counts() const override { return counts_; }
  void on_event(std::function<void(const drivers::CameraEvent&)>) override {}
  void set_exposure(const drivers::ExposureOptions&) override {}

  std::deque<std::optional<std::int64_t>> turns;
  bool streaming = true;
  drivers::CameraCounts counts_;
};

class StereoWatchTest : public testing::Test {
 protected:
  // One turn of the right camera's thread.
  void right(std::optional<std::int64_t> utime) {
    std::optional<drivers::CameraFrame> frame;
    if (utime) frame.emplace(frame_at(*utime)).sequence = right_counts_.frames++;
    reports_.put(frame, right_streaming_, right_counts_);
  }
  // The left camera's image comes `late_us` after it was taken.
  void left(std::int64_t utime, std::int64_t late_us = 1'000) {
    watch_.note(frame_at(utime), utime + late_us);
  }
  [[nodiscard]] InputCounts counts() const {
    InputCounts in;
    watch_.add_to(&in);
    return in;
  }
  static drivers::CameraFrame frame_at(std::int64_t utime) {
    drivers::CameraFrame frame;
    frame.utime = utime;
    return frame;
  }

  bool right_streaming_ = true;
  drivers::CameraCounts right_counts_;
  CameraReports reports_;
  StereoWatch watch_{&reports_, kTolerance_us};
};

TEST_F(StereoWatchTest, ImagesWithinTheToleranceArePairsWhicheverComesFirst) {
  for (int i = 0; i < 10; ++i) {
    right(i * kPeriod_us + kTolerance_us);
    left(i * kPeriod_us);
  }
  EXPECT_EQ(counts().stereo_pairs, 10);
  for (int i = 10; i < 20; ++i) {
    left(i * kPeriod_us);
    right(i * kPeriod_us - kTolerance_us);
  }
  watch_.note(std::nullopt, 20 * kPeriod_us);
  EXPECT_EQ(counts().stereo_pairs, 20);
  EXPECT_EQ(counts().stereo_left_alone, 0);
  EXPECT_EQ(counts().stereo_right_alone, 0);
}

TEST_F(StereoWatchTest, TheSkewIsThatOfTheLastPair) {
  left(0);
  right(3'000);
  left(kPeriod_us);
  EXPECT_EQ(counts().stereo_skew_us, 3'000);
  right(kPeriod_us - 2'000);
  left(2 * kPeriod_us);
  EXPECT_EQ(counts().stereo_skew_us, -2'000);
  right(2 * kPeriod_us + kTolerance_us + 1);
  watch_.note(std::nullopt, 3 * kPeriod_us + kPatience_us);
  EXPECT_EQ(counts().stereo_skew_us, -2'000);  // a single image has none
}

TEST_F(StereoWatchTest, ImagesFurtherApartAreAlone) {
  for (int i = 0; i < 10; ++i) {
    right(i * kPeriod_us + kTolerance_us + 1);
    left(i * kPeriod_us);
  }
  watch_.note(std::nullopt, 10 * kPeriod_us + kPatience_us);
  EXPECT_EQ(counts().stereo_pairs, 0);
  EXPECT_EQ(counts().stereo_left_alone, 10);
  EXPECT_EQ(counts().stereo_right_alone, 10);
}

TEST_F(StereoWatchTest, WhileTheSecondCameraIsAwayEachImageIsAloneAtOnce) {
  right(0);
  left(0);
  EXPECT_EQ(counts().stereo_pairs, 1);
  right(kPeriod_us);
  left(kPeriod_us);
  EXPECT_EQ(counts().stereo_pairs, 2);
  right_streaming_ = false;
  right(std::nullopt);
  left(2 * kPeriod_us);
  EXPECT_EQ(counts().stereo_left_alone, 1);
  right_streaming_ = true;
  right(3 * kPeriod_us);
  left(3 * kPeriod_us);
  EXPECT_EQ(counts().stereo_pairs, 3);
  EXPECT_EQ(counts().stereo_right_alone, 0);
}

TEST_F(StereoWatchTest, BeforeTheSecondCameraCameAnImageKeepsItsPlaceForAPartner) {
  left(0);
  EXPECT_EQ(counts().stereo_left_alone, 0);
  right(0);
  left(kPeriod_us);
  EXPECT_EQ(counts().stereo_pairs, 1);
  EXPECT_EQ(counts().stereo_right_alone, 0);
}

TEST_F(StereoWatchTest, WithoutASecondCameraEachImageIsCountedAsAloneWithin200Milliseconds) {
  for (int i = 0; i < 20; ++i) left(i * kPeriod_us);
  const std::int64_t due = kPatience_us / kPeriod_us;
  EXPECT_GE(counts().stereo_left_alone, 20 - due - 1);
  EXPECT_LT(counts().stereo_left_alone, 20);
}

TEST_F(StereoWatchTest, TheLastImageBeforeItWentStillFindsItsPartner) {
  right(0);
  left(0);
  left(kPeriod_us);
  right_streaming_ = false;
  right(kPeriod_us);
  left(2 * kPeriod_us);
  EXPECT_EQ(counts().stereo_pairs, 2);
  EXPECT_EQ(counts().stereo_left_alone, 1);
}

TEST_F(StereoWatchTest, ASilentPartnerIsGivenUpAfterAWhile) {
  right(0);
  left(0);
  left(kPeriod_us, 0);
  watch_.note(std::nullopt, kPeriod_us + kPatience_us - 1);
  EXPECT_EQ(counts().stereo_left_alone, 0);
  watch_.note(std::nullopt, kPeriod_us + kPatience_us);
  EXPECT_EQ(counts().stereo_left_alone, 1);
  // What comes after its turn has no partner any more.
  right(kPeriod_us);
  watch_.note(std::nullopt, 2 * kPeriod_us + kPatience_us);
  EXPECT_EQ(counts().stereo_right_alone, 1);
  EXPECT_EQ(counts().stereo_pairs, 1);
}

TEST_F(StereoWatchTest, EveryImageOfTheFirstIsCountedOnceAlsoOneThatComesAfterItsTurn) {
  right(0);
  watch_.note(std::nullopt, 0);
  watch_.note(std::nullopt, kPatience_us);  // given up: the first camera was away
  left(0, kPatience_us + 1);
  EXPECT_EQ(counts().stereo_right_alone, 1);
  EXPECT_EQ(counts().stereo_left_alone, 1);
  EXPECT_EQ(counts().stereo_pairs, 0);
}

TEST_F(StereoWatchTest, ImagesOfWhichNoReportTellsTheFirstCamerasThreadAreCountedToo) {
  for (int i = 0; i < 100; ++i) right(i * kPeriod_us);
  watch_.note(std::nullopt, 0);
  EXPECT_EQ(counts().images, 64);  // what there was room to tell
  right(std::nullopt);
  for (int i = 0; i < 2; ++i) watch_.note(std::nullopt, 100 * kPeriod_us + i * kPatience_us);
  EXPECT_EQ(counts().stereo_right_alone, 100);
  EXPECT_EQ(counts().images, 100);
}

TEST_F(StereoWatchTest, TheSecondCamerasCountsAreAddedToTheFirstOnes) {
  right_counts_.lost = 2;
  right_counts_.stalled = 1;
  right_counts_.missing = 5;
  right_counts_.flagged = 7;
  right(0);
  watch_.note(std::nullopt, 0);
  InputCounts in;
  in.images = 100;
  in.camera_losses = 10;
  watch_.add_to(&in);
  EXPECT_EQ(in.images, 108);
  EXPECT_EQ(in.camera_losses, 13);
  EXPECT_EQ(in.missing, 5);
  EXPECT_EQ(in.flagged, 7);
}

TEST(CameraSource, AnImageOfTheFirstCameraGoesOnInItsOwnTurnWithoutItsPartner) {
  auto right = std::make_unique<ScriptedCamera>(), left = std::make_unique<ScriptedCamera>();
  right->turns = {0};
  left->turns = {kPeriod_us, 2 * kPeriod_us, 3 * kPeriod_us};
  CameraSource further(1, std::move(right)), first(0, std::move(left));
  first.pair_with(&further, kTolerance_us);
  further.turn();  // it streams, so that a partner of what follows may still come
  const std::atomic<bool> stop{false};
  for (int i = 1; i <= 3; ++i) {
    CapturedImage image;
    ASSERT_EQ(first.next(stop, &image), CaptureStatus::kImage);
    EXPECT_EQ(image.meta.utime, i * kPeriod_us);
    EXPECT_EQ(image.in.images, i + 1);
  }
}

TEST(RecorderOfTwoCameras, EachHasItsChannelAndSizeAndOlderImagesComeFirst) {
  const test::Scratch scratch;
  const std::string path = scratch.path("run.lcm");
  calibration_t calibration = test::synthetic_calibration();
  calibration.cameras.push_back(calibration.cameras.front());
  calibration.ncameras = 2;
  calibration.cameras[0].width = 6;
  calibration.cameras[1].width = 4;
  calibration.cameras[0].height = calibration.cameras[1].height = 2;
  {
    Recorder recorder(path, {}, calibration);
    const ipc::GreyImage left{6, 2, std::vector<std::uint8_t>(12, 1)};
    const ipc::GreyImage right{4, 2, std::vector<std::uint8_t>(8, 2)};
    recorder.offer(1, right, {.utime = 150, .sequence = 8, .exposure_us = 42, .gain = 3.0F});
    recorder.offer(1, right, {.utime = 250, .sequence = 9, .exposure_us = -1, .gain = -1.0F});
    recorder.offer(0, left, {.utime = 100, .sequence = 3, .exposure_us = -1, .gain = -1.0F});
    recorder.offer(0, left, {.utime = 200, .sequence = 4, .exposure_us = -1, .gain = -1.0F});
    recorder.stop();
    recorder.run();
    recorder.close();
    EXPECT_EQ(recorder.written(), 4);
    EXPECT_EQ(recorder.left_out(), 0);
  }
  std::string order;
  for (const std::string& event : test::events_of(path)) order += event.substr(0, event.find(' ', 12)) + "; ";
  EXPECT_TRUE(order.starts_with("CALIBRATION ")) << order;
  EXPECT_TRUE(order.ends_with("; CAMERA_0 100; CAMERA_1 150; CAMERA_0 200; CAMERA_1 250; ")) << order;
  const auto right = test::messages_of<image_t>(path, "CAMERA_1");
  ASSERT_EQ(right.size(), 2U);
  EXPECT_EQ(right[0].camera, 1);
  EXPECT_EQ(right[0].width, 4);
  EXPECT_EQ(right[0].sequence, 8);
  EXPECT_EQ(right[0].exposure_us, 42);
  EXPECT_EQ(right[0].gain, 3.0F);
  EXPECT_EQ(right[0].data, std::vector<std::uint8_t>(8, 2));
  const auto left = test::messages_of<image_t>(path, "CAMERA_0");
  ASSERT_EQ(left.size(), 2U);
  EXPECT_EQ(left[1].camera, 0);
  EXPECT_EQ(left[1].data, std::vector<std::uint8_t>(12, 1));
}

}  // namespace
}  // namespace farpoint::daemon
