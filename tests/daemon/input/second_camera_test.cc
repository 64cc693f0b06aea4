// SPDX-License-Identifier: Apache-2.0
// The second camera, the first one's capture thread and the recorder, each on a thread of its own.
#include "daemon/input/second_camera.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "daemon/input/stereo_watch.h"
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

TEST(SecondCamera, EveryImageIsToldAndRecordedOnceWhileTheFirstOneRecordsToo) {
  const test::Scratch scratch;
  const std::string log = scratch.path("run.lcm");
  auto owned = std::make_unique<FastCamera>();
  FastCamera& camera = *owned;
  SecondCamera second(std::move(owned));
  StereoWatch watch(&second, kPeriod_us / 4);
  Recorder recorder(log, two_small_cameras());
  second.record_to(&recorder);
  std::thread recording([&] { recorder.run(); });
  std::thread capture([&] { second.run(); });
  // The first camera, with an image of the same time, as soon as the second has given its own.
  const ipc::GreyImage image{4, 2, std::vector<std::uint8_t>(8, 1)};
  for (int i = 0; i < kImages; ++i) {
    while (camera.given < i) std::this_thread::yield();
    recorder.offer(0, image, {.utime = kPeriod_us * i, .sequence = i, .exposure_us = -1, .gain = -1.0F});
    watch.note(kPeriod_us * i, kPeriod_us * i);
  }
  // Until the last of it has been told.
  const auto counts = [&watch] {
    InputCounts in;
    watch.add_to(&in);
    return in;
  };
  const auto is_told = [&] {
    watch.note(std::nullopt, kPeriod_us * (kImages + 1000));
    return counts().stereo_pairs + counts().stereo_right_alone == kImages;
  };
  for (int tries = 0; tries < 5000 && !is_told(); ++tries)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  second.stop();
  capture.join();
  recorder.stop();
  recording.join();
  recorder.close();

  const InputCounts in = counts();
  EXPECT_EQ(in.images, kImages);
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

}  // namespace
}  // namespace farpoint::daemon
