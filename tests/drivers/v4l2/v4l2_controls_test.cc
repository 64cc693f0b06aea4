// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/v4l2_controls.h"

#include <gtest/gtest.h>
#include <linux/videodev2.h>

#include <vector>

namespace farpoint::drivers {
namespace {

// A camera with manual exposure that takes a setting when the test lets it.
class SlowCamera final : public V4l2System {
 public:
  int open(const char* /*path*/) override { return 3; }
  void close(int /*fd*/) override {}
  int ioctl(int /*fd*/, unsigned long request, void* argument) override {
    if (request != VIDIOC_QUERYCTRL) return 0;
    auto* control = static_cast<v4l2_queryctrl*>(argument);
    if (control->id != V4L2_CID_EXPOSURE_ABSOLUTE) return -1;
    control->minimum = 1, control->maximum = 500;
    return 0;
  }
  void* map(int /*fd*/, std::size_t /*bytes*/, std::int64_t /*offset*/) override { return nullptr; }
  void unmap(void* /*memory*/, std::size_t /*bytes*/) override {}
  bool start_controls(int /*fd*/, std::span<const ControlValue> controls) override {
    ++started;
    controls_.assign(controls.begin(), controls.end());
    for (ControlValue& control : controls_) control.taken = true;
    return true;
  }
  std::span<const ControlValue> finished_controls() override {
    return slow ? std::span<const ControlValue>{} : controls_;
  }
  void wait_for_controls() override {}

  bool slow = true;
  int started = 0;

 private:
  std::vector<ControlValue> controls_;
};

// What images taken with the old setting say is not acted upon again.
TEST(V4l2Exposure, ADarkImageIsActedUponOnceUntilTheCameraHasFollowed) {
  SlowCamera camera;
  V4l2Exposure exposure;
  ExposureOptions options;
  options.mode = ExposureMode::kAuto;
  exposure.start(&camera, 3, options);
  const double before_us = exposure.exposure_us().value_or(-1);
  for (int i = 0; i < 100; ++i) exposure.update(10.0);
  EXPECT_EQ(camera.started, 1);
  EXPECT_EQ(exposure.exposure_us(), before_us);
  camera.slow = false;
  exposure.update(10.0);
  EXPECT_GT(exposure.exposure_us().value_or(-1), before_us);
  EXPECT_EQ(camera.started, 1) << "the images have not followed yet";
  for (int i = 0; i < 100; ++i) exposure.update(10.0);
  EXPECT_EQ(camera.started, 2);
  EXPECT_EQ(exposure.exposure_us(), options.max_us);
}

}  // namespace
}  // namespace farpoint::drivers
