// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/recorder.h"

#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

#include "drivers/can/wheel_reader.h"
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

wheels_t wheels(std::int64_t utime, double speed) {
  wheels_t message = drivers::wheels_with_room();
  message.utime = utime;
  message.speed = speed;
  message.nwheels = static_cast<std::int32_t>(message.wheel_speed.size());
  return message;
}

TEST_F(RecorderTest, WheelsStandBetweenTheImagesByTime) {
  recorder_.offer(wheels(-500, 1.0));
  recorder_.offer(wheels(1500, 2.0));
  recorder_.offer(wheels(9000, 3.0));
  offer(3);  // at 0, 1000 and 2000
  std::thread writer([&] { recorder_.run(); });
  recorder_.stop();
  writer.join();
  recorder_.close();
  std::vector<std::string> order;
  ipc::LogReader reader(scratch_.path("run.lcm"));
  for (ipc::LogEvent event; reader.next(&event);) order.emplace_back(event.channel);
  EXPECT_EQ(order, (std::vector<std::string>{"CALIBRATION", "WHEELS", "CAMERA_0", "CAMERA_0", "WHEELS",
                                             "CAMERA_0", "WHEELS"}));
  const auto recorded = test::messages_of<wheels_t>(scratch_.path("run.lcm"), ipc::kWheelsChannel);
  ASSERT_EQ(recorded.size(), 3U);
  EXPECT_EQ(recorded[1].utime, 1500);
  EXPECT_EQ(recorded[1].speed, 2.0);
}

TEST_F(RecorderTest, WheelsBeyondTheirRoomAreLeftOutAndCounted) {
  for (int i = 0; i < 300; ++i) recorder_.offer(wheels(i, 1.0));
  EXPECT_EQ(recorder_.left_out(), 300 - 256);
}

}  // namespace
}  // namespace farpoint::daemon
