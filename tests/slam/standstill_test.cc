// SPDX-License-Identifier: Apache-2.0
#include "slam/standstill.h"

#include <gtest/gtest.h>

namespace farpoint::slam {
namespace {

constexpr std::int64_t kSecond_us = 1'000'000;
constexpr double kDepth = 10.0;

Vector6d forward(double speed) {
  Vector6d v = Vector6d::Zero();
  v[0] = speed;
  return v;
}

TEST(Standstill, EqualImagesOfAVehicleThatStoodAreExplainedForTwoSeconds) {
  Standstill s;
  s.note_motion(forward(0.05), kDepth, kSecond_us, false);
  EXPECT_TRUE(s.explains_repeat(kSecond_us + 100));
  EXPECT_TRUE(s.explains_repeat(3 * kSecond_us));
  EXPECT_FALSE(s.explains_repeat(3 * kSecond_us + 1));
}

TEST(Standstill, EqualImagesOfAVehicleThatMovedAreNot) {
  Standstill s;
  EXPECT_FALSE(s.explains_repeat(0));
  s.note_motion(forward(0.2), kDepth, kSecond_us, false);
  EXPECT_FALSE(s.explains_repeat(kSecond_us + 100));
  Vector6d turn = Vector6d::Zero();
  turn[5] = 0.02;
  s.note_motion(turn, kDepth, 2 * kSecond_us, false);
  EXPECT_FALSE(s.explains_repeat(2 * kSecond_us + 100));
}

// Speed is seen as an angle: unknown units do not matter.
TEST(Standstill, TheUnitOfTheMapDoesNotMatter) {
  for (const double unit : {0.01, 100.0}) {
    Standstill s;
    s.note_motion(forward(0.05 * unit), kDepth * unit, kSecond_us, false);
    EXPECT_TRUE(s.stands());
    s.note_motion(forward(0.2 * unit), kDepth * unit, kSecond_us, false);
    EXPECT_FALSE(s.stands());
  }
}

TEST(Standstill, AfterALossNothingIsKnown) {
  Standstill s;
  s.note_motion(forward(0.0), kDepth, kSecond_us, false);
  s.note_loss();
  EXPECT_FALSE(s.explains_repeat(kSecond_us + 100));
}

// Half the image freezes at 10 m/s, and its landmarks claim a stop within one frame.
TEST(Standstill, AFrozenPartOfTheImageDoesNotStopAFastVehicle) {
  Standstill s;
  s.note_motion(forward(10.0), kDepth, kSecond_us, false);
  for (int i = 1; i < 50; ++i) s.note_motion(forward(0.0), kDepth, kSecond_us + i * 100'000, true);
  EXPECT_FALSE(s.stands());
}

TEST(Standstill, ASlowVehicleStopsThoughItsEncoderRepeatsPartsOfTheImage) {
  Standstill s;
  s.note_motion(forward(1.0), kDepth, kSecond_us, false);
  s.note_motion(forward(0.0), kDepth, kSecond_us + 100'000, true);
  EXPECT_TRUE(s.stands());
}

}  // namespace
}  // namespace farpoint::slam
