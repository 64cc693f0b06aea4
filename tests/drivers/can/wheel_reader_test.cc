// SPDX-License-Identifier: Apache-2.0
#include "drivers/can/wheel_reader.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "tests/ipc/scratch.h"

namespace farpoint::drivers {
namespace {

class Wheels : public testing::Test {
 protected:
  Wheels() : path_(scratch_.path("a.dbc")) {
    std::ofstream(path_) << "BO_ 291 Front: 8 ABS\n"
                            " SG_ L : 0|16@1+ (0.01,0) [0|600] \"km/h\"  X\n"
                            " SG_ R : 16|16@1+ (0.01,0) [0|600] \"km/h\"  X\n"
                            " SG_ T : 32|16@1+ (1,0) [0|600] \"degC\"  X\n"
                            "BO_ 292 Rear: 8 ABS\n"
                            " SG_ L : 0|16@1+ (0.01,0) [0|100] \"m/s\"  X\n";
  }
  [[nodiscard]] std::string complaint(const std::string& names) const {
    try {
      WheelReader reader(path_, names);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }
  const test::Scratch scratch_;
  const std::string path_;
};

TEST_F(Wheels, AMeasurementIsWholeWhenEveryWheelWasHeard) {
  WheelReader reader(path_, "Front.L, Front.R,Rear.L");
  EXPECT_EQ(reader.ids(), (std::vector<std::uint32_t>{291, 292}));
  wheels_t m{};
  // 36.00 km/h = 3600 = 0x0E10 and 72.00 km/h = 0x1C20; 15.00 m/s = 0x05DC.
  const ipc::CanFrame front{291, 8, {0x10, 0x0E, 0x20, 0x1C}}, rear{292, 8, {0xDC, 0x05}};
  EXPECT_FALSE(reader.take(front, 1, &m));
  EXPECT_FALSE(reader.take(front, 2, &m));
  ASSERT_TRUE(reader.take(rear, 3, &m));
  EXPECT_EQ(m.utime, 3);
  ASSERT_EQ(m.nwheels, 3);
  EXPECT_NEAR(m.wheel_speed[0], 10.0, 1e-9);
  EXPECT_NEAR(m.wheel_speed[1], 20.0, 1e-9);
  EXPECT_NEAR(m.speed, 15.0, 1e-9);
  EXPECT_FALSE(reader.take(rear, 4, &m));  // the others are of before
}

TEST_F(Wheels, AWheelThatIsNotAvailableIsLeftOutOfTheSpeed) {
  WheelReader reader(path_, "Front.L,Front.R");
  wheels_t m{};
  ASSERT_TRUE(reader.take({291, 8, {0xFF, 0xFF, 0x20, 0x1C}}, 1, &m));
  EXPECT_TRUE(std::isnan(m.wheel_speed[0]));
  EXPECT_NEAR(m.speed, 20.0, 1e-9);
  ASSERT_TRUE(reader.take({291, 8, {0xFF, 0xFF, 0xFF, 0xFF}}, 2, &m));
  EXPECT_TRUE(std::isnan(m.speed));
}

TEST_F(Wheels, MistakesAreNamed) {
  EXPECT_EQ(complaint("Front"), "wheel signal 'Front', expected MESSAGE.SIGNAL");
  EXPECT_EQ(complaint("Front.L,"), "wheel signal '', expected MESSAGE.SIGNAL");
  EXPECT_EQ(complaint("Front.T"), "wheel signal Front.T has the unit 'degC', expected m/s or km/h");
  EXPECT_EQ(complaint("Front.L,Front.L,Front.L,Front.L,Front.L"), "5 wheel signals, expected one to four");
}

}  // namespace
}  // namespace farpoint::drivers
