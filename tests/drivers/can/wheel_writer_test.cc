// SPDX-License-Identifier: Apache-2.0
#include "drivers/can/wheel_writer.h"

#include <gtest/gtest.h>

#include <fstream>

#include "drivers/can/wheel_reader.h"
#include "tests/ipc/scratch.h"

namespace farpoint::drivers {
namespace {

constexpr const char* kFour = "Front.L,Front.R,Rear.L,Rear.R";

class WheelWriterTest : public testing::Test {
 protected:
  WheelWriterTest() : path_(scratch_.path("a.dbc")) {
    std::ofstream(path_) << "BO_ 291 Front: 8 ABS\n"
                            " SG_ L : 7|16@0- (0.01,0) [-300|300] \"km/h\"  X\n"
                            " SG_ R : 23|16@0- (0.01,0) [-300|300] \"km/h\"  X\n"
                            "BO_ 292 Rear: 8 ABS\n"
                            " SG_ L : 0|16@1+ (0.001,0) [0|60] \"m/s\"  X\n"
                            " SG_ R : 16|16@1+ (0.001,0) [0|60] \"m/s\"  X\n"
                            "BO_ 294 Shifted: 8 ABS\n"
                            " SG_ L : 0|16@1+ (0.01,-67.67) [-67|300] \"km/h\"  X\n"
                            " SG_ R : 16|16@1+ (0.01,-67.67) [-67|300] \"km/h\"  X\n"
                            "BO_ 293 Long: 24 ABS\n"
                            " SG_ L : 96|16@1- (0.01,0) [0|0] \"m/s\"  X\n";
  }
  const test::Scratch scratch_;
  const std::string path_;
};

wheels_t moving_at(const std::vector<double>& speeds_m_s) {
  wheels_t message{};
  message.nwheels = static_cast<std::int32_t>(speeds_m_s.size());
  message.wheel_speed = speeds_m_s;
  return message;
}

TEST_F(WheelWriterTest, TheReaderHearsWhatWasWritten) {
  WheelWriter writer(path_, kFour);
  WheelReader reader(path_, kFour);
  for (const double speed : {0.0, 0.37, 12.345, 33.0}) {
    const std::vector<double> speeds = {speed, -speed, speed + 0.5, speed + 1.0};
    const std::span<const ipc::CanFrame> frames = writer.frames(moving_at(speeds));
    ASSERT_EQ(frames.size(), 2U);
    wheels_t heard{};
    EXPECT_FALSE(reader.take(frames[0], 7, &heard));
    ASSERT_TRUE(reader.take(frames[1], 7, &heard));
    for (std::size_t i = 0; i < 4; ++i)
      EXPECT_NEAR(heard.wheel_speed[i], speeds[i], i < 2 ? 0.005 / 3.6 + 1e-9 : 0.0005 + 1e-9)
          << speed << " " << i;
  }
  EXPECT_EQ(writer.limited(), 0U);
  EXPECT_FALSE(writer.needs_fd());
}

TEST_F(WheelWriterTest, ASpeedThatItsSignalCannotHoldIsCounted) {
  WheelWriter writer(path_, kFour);
  WheelReader reader(path_, kFour);
  const std::span<const ipc::CanFrame> frames = writer.frames(moving_at({-1.0, 1.0, -1.0, 70.0}));
  EXPECT_EQ(writer.limited(), 2U);
  wheels_t heard{};
  EXPECT_FALSE(reader.take(frames[0], 0, &heard));
  ASSERT_TRUE(reader.take(frames[1], 0, &heard));
  EXPECT_EQ(heard.wheel_speed[2], 0.0);
  EXPECT_NEAR(heard.wheel_speed[3], 60.0, 1e-9);
}

TEST_F(WheelWriterTest, WheelsThatAreNotGivenStandStill) {
  const std::string names = "Shifted.L,Shifted.R";
  WheelWriter writer(path_, names);
  WheelReader reader(path_, names);
  wheels_t heard{};
  ASSERT_TRUE(reader.take(writer.frames(moving_at({2.0}))[0], 0, &heard));
  EXPECT_NEAR(heard.wheel_speed[0], 2.0, 0.005 / 3.6 + 1e-9);
  EXPECT_NEAR(heard.wheel_speed[1], 0.0, 0.005 / 3.6 + 1e-9);
}

TEST_F(WheelWriterTest, LongMessagesNeedCanFd) {
  WheelWriter writer(path_, "Long.L");
  EXPECT_TRUE(writer.needs_fd());
  EXPECT_EQ(writer.frames(moving_at({1.5, 2.0, 2.0, 2.0}))[0].size, 24);
}

}  // namespace
}  // namespace farpoint::drivers
