// SPDX-License-Identifier: Apache-2.0
#include "ipc/dbc.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <utility>
#include <vector>

#include "tests/ipc/scratch.h"
#include "tests/support/paths.h"

namespace farpoint::ipc {
namespace {

constexpr const char* kText =
    "VERSION \"\"\n"
    "BO_ 291 Wheels: 8 ABS\n"
    " SG_ FrontLeft : 7|16@0+ (0.01,0) [0|600] \"km/h\"  Vector__XXX\n"
    " SG_ FrontRight : 16|16@1+ (0.01,0) [0|600] \"km/h\"  Vector__XXX\n"
    " SG_ YawRate : 39|12@0- (0.1,0) [-200|200] \"deg/s\"  Vector__XXX\n"
    " SG_ Outside : 60|8@1+ (1,0) [0|0] \"\"  Vector__XXX\n"
    " SG_ Broken : 60|8\n"
    "BO_ 2147484000 Far: 8 ABS\n"
    " SG_ X : 0|8@1+ (1,0) [0|0] \"\"  Vector__XXX\n"
    "BO_ 292 Other: 4 ABS\n"
    " SG_ FrontLeft : 0|8@1- (1,-3) [0|0] \"\"  Vector__XXX\n"
    "BO_ 293 Long: 64 ABS\n"
    " SG_ Last : 496|16@1+ (1,0) [0|0] \"\"  Vector__XXX\n"
    "BO_ 294 TooLong: 65 ABS\n"
    " SG_ First : 0|8@1+ (1,0) [0|0] \"\"  Vector__XXX\n"
    "BO_ 295 Odd: 8 ABS\n"
    " SG_ NoFactor : 0|8@1+ (0,0) [0|0] \"\"  Vector__XXX\n"
    " SG_ NanFactor : 0|8@1+ (nan,0) [0|0] \"\"  Vector__XXX\n"
    " SG_ NanOffset : 0|8@1+ (1,nan) [0|0] \"\"  Vector__XXX\n"
    " SG_ Infinite : 0|8@1+ (1,0) [0|inf] \"\"  Vector__XXX\n"
    " SG_ Backwards : 0|8@1+ (1,0) [100|0] \"\"  Vector__XXX\n";

class DbcText : public testing::Test {
 protected:
  DbcText() : path_(scratch_.path("a.dbc")) { std::ofstream(path_) << kText; }
  [[nodiscard]] std::string complaint(const std::string& message, const std::string& signal) const {
    try {
      (void)read_dbc_signal(path_, message, signal);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }
  const test::Scratch scratch_;
  const std::string path_;
};

TEST_F(DbcText, MotorolaAndIntel) {
  // 0x1234 = 4660: 46.6 km/h. Motorola from bit 7: bytes 0 and 1 as written; Intel: low byte first.
  const CanFrame frame{291, 8, {0x12, 0x34, 0x34, 0x12, 0, 0, 0, 0}};
  const DbcSignal left = read_dbc_signal(path_, "Wheels", "FrontLeft");
  EXPECT_EQ(left.unit, "km/h");
  EXPECT_NEAR(left.value(frame), 46.60, 1e-9);
  EXPECT_NEAR(read_dbc_signal(path_, "Wheels", "FrontRight").value(frame), 46.60, 1e-9);
}

TEST_F(DbcText, SignedMotorolaAcrossBytes) {
  // Twelve bits from bit 39 (byte 4, bit 7): byte 4 and the upper half of byte 5. -5 = 0xFFB.
  const DbcSignal yaw = read_dbc_signal(path_, "Wheels", "YawRate");
  EXPECT_NEAR(yaw.value({291, 8, {0, 0, 0, 0, 0xFF, 0xB0, 0, 0}}), -0.5, 1e-9);
  EXPECT_NEAR(yaw.value({291, 8, {0, 0, 0, 0, 0x01, 0x2F, 0, 0}}), 1.8, 1e-9);
}

TEST_F(DbcText, OfTwoSignalsOfANameThatOfTheMessage) {
  const DbcSignal other = read_dbc_signal(path_, "Other", "FrontLeft");
  EXPECT_EQ(other.id, 292U);
  EXPECT_NEAR(other.value({292, 4, {0xFF}}), -4.0, 1e-9);
}

TEST_F(DbcText, CanFdMessagesAreLonger) {
  CanFrame frame{293, 64, {}};
  frame.data[62] = 0x34;
  frame.data[63] = 0x12;
  EXPECT_NEAR(read_dbc_signal(path_, "Long", "Last").value(frame), 4660.0, 1e-9);
  EXPECT_EQ(complaint("TooLong", "First"), path_ + ":15: message TooLong has 65 bytes, expected 1 to 64");
}

TEST_F(DbcText, WhatIsNoValueIsNaN) {
  const DbcSignal left = read_dbc_signal(path_, "Wheels", "FrontLeft");
  EXPECT_TRUE(std::isnan(left.value({290, 8, {}})));            // another frame
  EXPECT_TRUE(std::isnan(left.value({291, 4, {}})));            // cut off
  EXPECT_TRUE(std::isnan(left.value({291, 8, {0xFF, 0xFF}})));  // beyond the range: not available
}

// Every kind of layout: what is put in comes out, to half a step, and bits beside it stay as they were.
TEST_F(DbcText, WhatIsPutIntoAFrameIsReadFromIt) {
  const std::vector<std::pair<const char*, const char*>> names = {
      {"Wheels", "FrontLeft"}, {"Wheels", "FrontRight"}, {"Wheels", "YawRate"}, {"Long", "Last"}};
  for (const auto& [message, name] : names) {
    const DbcSignal signal = read_dbc_signal(path_, message, name);
    const double least = signal.is_signed ? -200.0 : 0.0;
    for (double physical = least; physical <= 200.0; physical += 7.77) {
      CanFrame zeros, ones;
      ones.data.fill(0xFF);
      ASSERT_TRUE(signal.put(physical, &zeros)) << name << " " << physical;
      ASSERT_TRUE(signal.put(physical, &ones)) << name << " " << physical;
      EXPECT_EQ(zeros.id, signal.id);
      EXPECT_EQ(zeros.size, signal.size);
      EXPECT_NEAR(signal.value(zeros), physical, 0.5 * signal.factor + 1e-9) << name;
      EXPECT_EQ(signal.value(zeros), signal.value(ones)) << name;
      int own = 0;
      for (std::size_t i = 0; i < zeros.data.size(); ++i)
        own += 8 - std::popcount(static_cast<unsigned>(zeros.data[i] ^ ones.data[i]));
      EXPECT_EQ(own, static_cast<int>(signal.length)) << name << ": other bits were touched";
    }
  }
}

TEST_F(DbcText, SignedMotorolaIsPutAsItIsRead) {
  // -5 = 0xFFB in twelve bits from byte 4 on.
  CanFrame frame;
  ASSERT_TRUE(read_dbc_signal(path_, "Wheels", "YawRate").put(-0.5, &frame));
  EXPECT_EQ(frame.id, 291U);
  EXPECT_EQ(frame.data[4], 0xFF);
  EXPECT_EQ(frame.data[5], 0xB0);
}

TEST_F(DbcText, WhatDoesNotFitIsPutAtTheLimitAndSaid) {
  const DbcSignal left = read_dbc_signal(path_, "Wheels", "FrontLeft");  // 0 to 600 in steps of 0.01
  CanFrame frame;
  EXPECT_FALSE(left.put(-0.2, &frame));
  EXPECT_EQ(left.value(frame), 0.0);
  EXPECT_FALSE(left.put(601.0, &frame));
  EXPECT_NEAR(left.value(frame), 600.0, 1e-9);
  const DbcSignal other = read_dbc_signal(path_, "Other", "FrontLeft");  // eight bits, no range, offset -3
  EXPECT_FALSE(other.put(1000.0, &frame));
  EXPECT_NEAR(other.value(frame), 124.0, 1e-9);
  EXPECT_FALSE(other.put(-1000.0, &frame));
  EXPECT_NEAR(other.value(frame), -131.0, 1e-9);
  const CanFrame before = frame;
  EXPECT_FALSE(other.put(std::nan(""), &frame));
  EXPECT_EQ(frame.data, before.data);
}

// Ranges that end between two steps: what is put in is never outside, so that it is read again.
TEST(DbcSignal, WhatIsPutAtALimitIsInTheRange) {
  CanFrame frame;
  for (const double factor : {0.01, 0.4, 1.0 / 256.0, -0.01, 3.0}) {
    for (int sixteenths = 16; sixteenths < 48; ++sixteenths) {
      DbcSignal s;
      s.length = 16;
      s.is_signed = true;
      s.factor = factor;
      s.min = -std::abs(factor) * sixteenths / 16.0;
      s.max = std::abs(factor) * (sixteenths + 7) / 16.0;
      for (const double physical : {s.min, s.max, 2.0 * s.min, 2.0 * s.max}) {
        EXPECT_EQ(s.put(physical, &frame), physical == s.min || physical == s.max);
        EXPECT_LE(s.value(frame), s.max + 1e-9);
        EXPECT_GE(s.value(frame), s.min - 1e-9);
        EXPECT_LE(std::abs(s.value(frame) - std::clamp(physical, s.min, s.max)), std::abs(factor));
      }
    }
  }
}

TEST(DbcSignal, ARangeThatHoldsNoNumberTakesNothing) {
  DbcSignal s;
  s.length = 8;
  s.min = 0.25;
  s.max = 0.75;
  CanFrame frame;
  EXPECT_FALSE(s.put(0.5, &frame));
  EXPECT_EQ(frame.id, CanFrame{}.id);
  EXPECT_EQ(frame.data, CanFrame{}.data);
}

TEST(DbcSignal, SixtyFourBitsHoldTheirLimits) {
  DbcSignal whole;
  whole.length = 64;
  CanFrame frame;
  EXPECT_FALSE(whole.put(1e30, &frame));
  EXPECT_NEAR(whole.value(frame), std::ldexp(1.0, 64), std::ldexp(1.0, 12));
  whole.is_signed = true;
  EXPECT_FALSE(whole.put(-1e30, &frame));
  EXPECT_EQ(whole.value(frame), -std::ldexp(1.0, 63));
  EXPECT_TRUE(whole.put(-5.0, &frame));
  EXPECT_EQ(whole.value(frame), -5.0);
}

TEST_F(DbcText, MistakesAreNamed) {
  EXPECT_EQ(complaint("Nowhere", "X"), path_ + ": no message Nowhere, expected MESSAGE.SIGNAL of this file");
  EXPECT_EQ(complaint("Wheels", "Nothing"),
            path_ + ": message Wheels has no signal Nothing, expected MESSAGE.SIGNAL of this file");
  EXPECT_EQ(complaint("Wheels", "Outside"), path_ + ":6: signal Outside lies outside its frame of 8 bytes");
  EXPECT_NE(complaint("Wheels", "Broken").find(":7: signal Broken: expected"), std::string::npos);
  EXPECT_NE(complaint("Far", "X").find("extended identifier"), std::string::npos);
  for (const char* name : {"NoFactor", "NanFactor", "NanOffset", "Infinite", "Backwards"})
    EXPECT_NE(complaint("Odd", name).find("expected a factor other than 0"), std::string::npos) << name;
  EXPECT_THROW((void)read_dbc_signal("/nonexistent.dbc", "A", "B"), std::runtime_error);
}

// The shipped file describes our own frames: its signals can be read too.
TEST(DbcFile, OneThatDoesNotEndIsRefused) {
  try {
    (void)read_dbc_signal("/dev/zero", "Wheels", "FrontLeft");
    FAIL() << "accepted";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "/dev/zero: longer than 16 MiB, expected a DBC file");
  }
}

TEST(DbcShipped, IsRead) {
  const DbcSignal age =
      read_dbc_signal(test::source_dir() + "/config/farpoint.dbc", "FARPOINT_STATUS", "Age");
  EXPECT_EQ(age.id, 0x680U);
}

}  // namespace
}  // namespace farpoint::ipc
