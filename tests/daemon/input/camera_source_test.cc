// SPDX-License-Identifier: Apache-2.0
// Two cameras and the recorder, each on a thread of its own.
#include "daemon/input/camera_source.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include "tests/ipc/log_events.h"
#include "tests/ipc/scratch.h"

namespace farpoint::daemon {
namespace {

constexpr std::int64_t kPeriod_us = 10'000;
constexpr int kImages = 2000;

// Gives its images as fast as they are taken, then none; away for a moment every hundred images.
class FastCamera final : public drivers::Camera {
 public:
  bool next(int, ipc::GreyImage* image, drivers::CameraFrame* frame) override {
    std::this_thread::sleep_for(std::chrono::microseconds(given == kImages ? 1000 : 20));
    streaming_ = given % 100 != 99 || !streaming_;
    if (!streaming_ || given == kImages) return false;
    *image = {4, 2, std::vector<std::uint8_t>(8, static_cast<std::uint8_t>(given))};
    frame->utime = kPeriod_us * given;
    frame->sequence = given++;
    ++counts_.frames;
    return true;
  }
  [[nodiscard]] bool is_streaming() const override { return streaming_; }
  [[nodiscard]] const drivers::CameraCounts& counts() const override { return counts_; }
  void on_event(std::function<void(const drivers::CameraEvent&)>) override {}
  void set_exposure(const drivers::ExposureOptions&) override {}

  std::atomic<int> given{0};

 private:
  bool streaming_ = true;
  drivers::CameraCounts counts_;
};

calibration_t two_small_cameras() {
  camera_calibration_t camera{};
  camera.width = 4;
  camera.height = 2;
  calibration_t calibration{};
  calibration.ncameras = 2;
  calibration.cameras = {camera, camera};
  return calibration;
}

// Gives an image of the same time as soon as the other camera has given its own, then none.
class FollowingCamera final : public drivers::Camera {
 public:
  explicit FollowingCamera(const FastCamera* leader) : leader_(leader) {}
  bool next(int, ipc::GreyImage* image, drivers::CameraFrame* frame) override {
    if (counts_.frames == kImages) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      return false;
    }
    while (leader_->given < counts_.frames) std::this_thread::yield();
    *image = {4, 2, std::vector<std::uint8_t>(8, 1)};
    frame->utime = kPeriod_us * counts_.frames;
    frame->sequence = counts_.frames++;
    return true;
  }
  [[nodiscard]] bool is_streaming() const override { return true; }
  [[nodiscard]] const drivers::CameraCounts& counts() const override { return counts_; }
  void on_event(std::function<void(const drivers::CameraEvent&)>) override {}
  void set_exposure(const drivers::ExposureOptions&) override {}

 private:
  const FastCamera* leader_;
  drivers::CameraCounts counts_;
};

// Says what it streams, then gives one image; calls no thread.
class DescribedCamera final : public drivers::Camera {
 public:
  bool next(int, ipc::GreyImage*, drivers::CameraFrame* frame) override {
    if (turn++ == 0) {
      drivers::CameraEvent event;
      event.kind = drivers::CameraEvent::Kind::kStreaming;
      event.format = drivers::CameraFormat::kNv12;
      event.rate_hz = 25.0;
      listener_(event);
      return false;
    }
    frame->exposure_us = 3000;
    frame->gain = 2.0F;
    return true;
  }
  [[nodiscard]] bool is_streaming() const override { return true; }
  [[nodiscard]] const drivers::CameraCounts& counts() const override { return counts_; }
  void on_event(std::function<void(const drivers::CameraEvent&)> listener) override {
    listener_ = std::move(listener);
  }
  void set_exposure(const drivers::ExposureOptions&) override {}

  int turn = 0;

 private:
  std::function<void(const drivers::CameraEvent&)> listener_;
  drivers::CameraCounts counts_;
};

TEST(CameraSource, AnImageComesWithFormatRateAndExposureOfItsStream) {
  CameraSource source(0, std::make_unique<DescribedCamera>());
  const std::atomic<bool> stop{false};
  CapturedImage image;
  ASSERT_EQ(source.next(stop, &image), CaptureStatus::kNothing);
  EXPECT_EQ(image.camera.format, drivers::CameraFormat::kNv12);
  EXPECT_EQ(image.camera.exposure_us, -1);
  ASSERT_EQ(source.next(stop, &image), CaptureStatus::kImage);
  EXPECT_EQ(image.camera.format, drivers::CameraFormat::kNv12);
  EXPECT_EQ(image.camera.rate_hz, 25.0);
  EXPECT_EQ(image.camera.exposure_us, 3000);
  EXPECT_EQ(image.camera.gain, 2.0F);
  drivers::CameraEvent event;
  EXPECT_TRUE(source.take_event(&event)) << "the log has it too";
}

TEST(CameraSource, EveryImageOfAFurtherCameraIsReportedAndRecordedOnceWhileTheFirstOneRecordsToo) {
  const test::Scratch scratch;
  const std::string log = scratch.path("run.lcm");
  auto owned = std::make_unique<FastCamera>();
  const FastCamera* fast = owned.get();
  CameraSource first(0, std::make_unique<FollowingCamera>(fast));
  CameraSource further(1, std::move(owned));
  first.pair_with(&further, kPeriod_us / 4);
  Recorder recorder(log, {}, two_small_cameras());
  first.record_to(&recorder);
  further.record_to(&recorder);
  std::thread recording([&] { recorder.run(); });
  std::thread capture([&] { further.run(); });
  const std::atomic<bool> stop{false};
  CapturedImage image;
  for (int i = 0; i < kImages; ++i) {
    ASSERT_EQ(first.next(stop, &image), CaptureStatus::kImage);
    ASSERT_EQ(image.meta.sequence, i);
  }
  // Until the last image is reported.
  const auto is_reported = [&] {
    (void)first.next(stop, &image);
    return image.in.stereo_pairs + image.in.stereo_right_alone == kImages;
  };
  for (int tries = 0; tries < 5000 && !is_reported(); ++tries) continue;
  further.stop();
  capture.join();
  recorder.stop();
  recording.join();
  recorder.close();

  const InputCounts& in = image.in;
  EXPECT_EQ(in.images, 2 * kImages);
  EXPECT_EQ(in.stereo_pairs + in.stereo_left_alone, kImages);
  EXPECT_EQ(in.stereo_pairs + in.stereo_right_alone, kImages);
  EXPECT_GT(in.stereo_pairs, 0);
  EXPECT_EQ(recorder.written() + recorder.left_out(), 2 * kImages);
  const auto left = test::messages_of<image_t>(log, "CAMERA_0");
  const auto right = test::messages_of<image_t>(log, "CAMERA_1");
  EXPECT_EQ(static_cast<std::int64_t>(left.size() + right.size()), recorder.written());
  for (const image_t& m : right)
    ASSERT_EQ(m.data, std::vector<std::uint8_t>(8, static_cast<std::uint8_t>(m.sequence)));
  for (std::size_t i = 1; i < right.size(); ++i) ASSERT_GT(right[i].utime, right[i - 1].utime);
}

TEST(CameraSource, ThreeCamerasAreCountedTogether) {
  std::vector<std::unique_ptr<FastCamera>> owned;
  owned.reserve(3);
  for (int i = 0; i < 3; ++i) owned.push_back(std::make_unique<FastCamera>());
  CameraSource first(0, std::move(owned[0])), second(1, std::move(owned[1])), third(2, std::move(owned[2]));
  first.pair_with(&second, kPeriod_us / 4);
  first.pair_with(&third, kPeriod_us / 4);
  EXPECT_EQ(third.thread_name(), "fp-capture-2");
  const std::atomic<bool> stop{false};
  CapturedImage image;
  for (int i = 0; i < 20; ++i) {
    second.turn();
    third.turn();
    ASSERT_EQ(first.next(stop, &image), CaptureStatus::kImage);
  }
  EXPECT_EQ(image.in.images, 3 * 20);
  EXPECT_EQ(image.in.stereo_pairs, 2 * 20);
}

}  // namespace
}  // namespace farpoint::daemon
