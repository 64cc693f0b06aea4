// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/v4l2_controls.h"

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <utility>

namespace farpoint::drivers {
namespace {

// A camera with manual exposure whose control calls end when the test lets them.
class SlowCamera final : public V4l2System {
 public:
  int open(const char* /*path*/) override { return 3; }
  void close(int /*fd*/) override {}
  int ioctl(int /*fd*/, unsigned long request, void* argument) override {
    ++calls;
    if (request == VIDIOC_S_CTRL) {
      const auto* set = static_cast<const v4l2_control*>(argument);
      if (set->id == V4L2_CID_EXPOSURE_ABSOLUTE) exposure_us = 100.0 * set->value;
      return 0;
    }
    if (request != VIDIOC_QUERYCTRL) return 0;
    auto* control = static_cast<v4l2_queryctrl*>(argument);
    if (control->id != V4L2_CID_EXPOSURE_ABSOLUTE) return -1;
    control->minimum = 1, control->maximum = 500;
    return 0;
  }
  void* map(int /*fd*/, std::size_t /*bytes*/, std::int64_t /*offset*/) override { return nullptr; }
  void unmap(void* /*memory*/, std::size_t /*bytes*/) override {}
  bool start_controls(ControlJob* job) override {
    if (job_ != nullptr) return false;
    ++started;
    job_ = job;
    return true;
  }
  bool finished_controls() override {
    if (slow || job_ == nullptr) return false;
    std::exchange(job_, nullptr)->run();
    return true;
  }
  void wait_for_controls() override { job_ = nullptr; }

  bool slow = true;
  int started = 0, calls = 0;
  double exposure_us = 0;

 private:
  ControlJob* job_ = nullptr;
};

void image(V4l2Exposure* exposure, double mean_grey) {
  exposure->poll();
  exposure->update(mean_grey);
}

// What images taken with the old setting say is not acted upon again.
TEST(V4l2Exposure, ADarkImageIsActedUponOnceUntilTheCameraHasFollowed) {
  SlowCamera camera;
  V4l2Exposure exposure;
  ExposureOptions options;
  options.mode = ExposureMode::kAuto;
  exposure.start(&camera, 3, options);
  const double before_us = exposure.exposure_us().value_or(-1);
  for (int i = 0; i < 100; ++i) image(&exposure, 10.0);
  EXPECT_EQ(camera.started, 1);
  EXPECT_EQ(exposure.exposure_us(), before_us);
  camera.slow = false;
  image(&exposure, 10.0);
  EXPECT_GT(exposure.exposure_us().value_or(-1), before_us);
  EXPECT_EQ(camera.started, 1) << "the images have not followed yet";
  for (int i = 0; i < 100; ++i) image(&exposure, 10.0);
  EXPECT_EQ(camera.started, 2);
  EXPECT_EQ(exposure.exposure_us(), options.max_us);
}

TEST(V4l2Exposure, NewOptionsMakeNoControlCallOnTheCaptureThreadAndHoldOnceTheCameraHasFollowed) {
  SlowCamera camera;
  V4l2Exposure exposure;
  ExposureOptions options;
  options.mode = ExposureMode::kManual;
  options.manual_us = 2000;
  exposure.start(&camera, 3, options);
  EXPECT_EQ(exposure.exposure_us(), 2000.0);
  const int calls = camera.calls;
  options.manual_us = 9000;
  exposure.restart(options);
  for (int i = 0; i < 10; ++i) image(&exposure, 100.0);
  EXPECT_EQ(camera.calls, calls);
  EXPECT_EQ(camera.started, 1);
  EXPECT_FALSE(exposure.exposure_us());
  options.manual_us = 7000;
  exposure.restart(options);  // while the first is under way
  camera.slow = false;
  for (int i = 0; i < 3; ++i) image(&exposure, 100.0);
  EXPECT_EQ(exposure.exposure_us(), 7000.0);
  EXPECT_EQ(camera.exposure_us, 7000.0);
  EXPECT_EQ(camera.started, 2);
}

TEST(V4l2Exposure, NewOptionsBeginTheAutomaticAnew) {
  SlowCamera camera;
  camera.slow = false;
  V4l2Exposure exposure;
  ExposureOptions options;
  options.mode = ExposureMode::kManual;
  exposure.start(&camera, 3, options);
  EXPECT_FALSE(exposure.needs_brightness());
  options.mode = ExposureMode::kAuto;
  exposure.restart(options);
  EXPECT_FALSE(exposure.needs_brightness());
  exposure.poll();
  EXPECT_TRUE(exposure.needs_brightness());
  for (int i = 0; i < 100; ++i) image(&exposure, 10.0);
  EXPECT_EQ(camera.exposure_us, options.max_us);
}

}  // namespace
}  // namespace farpoint::drivers
