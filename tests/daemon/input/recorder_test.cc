// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/recorder.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "tests/ipc/log_events.h"
#include "tests/ipc/scratch.h"

namespace farpoint::daemon {
namespace {

calibration_t one_small_camera() {
  calibration_t calibration{};
  calibration.ncameras = 1;
  camera_calibration_t camera{};
  camera.name = "front";
  camera.width = 4;
  camera.height = 2;
  calibration.cameras = {camera};
  return calibration;
}

class RecorderTest : public testing::Test {
 protected:
  void offer(int count) {
    for (int i = 0; i < count; ++i) {
      drivers::CameraFrame frame;
      frame.utime = 1000 * next_;
      frame.sequence = next_++;
      recorder_.offer(0, {4, 2, std::vector<std::uint8_t>(8, 7)}, frame);
    }
  }
  const test::Scratch scratch_;
  Recorder recorder_{scratch_.path("run.lcm"), {.waiting_images = 3}, one_small_camera()};

 private:
  int next_ = 0;
};

// No thread writes yet: the disk hangs.
TEST_F(RecorderTest, ImagesBeyondTheConfiguredWaitAreLeftOutAndCounted) {
  offer(3);
  EXPECT_EQ(recorder_.left_out(), 0);
  offer(2);
  EXPECT_EQ(recorder_.left_out(), 2);
  std::thread writer([&] { recorder_.run(); });
  recorder_.stop();
  writer.join();
  recorder_.close();
  EXPECT_EQ(recorder_.written(), 3);
}

}  // namespace
}  // namespace farpoint::daemon
