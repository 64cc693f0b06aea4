// SPDX-License-Identifier: Apache-2.0
#include "tools/top/board.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

namespace farpoint::tools {
namespace {

status_t status_of(int state) {
  status_t s{};
  s.state = static_cast<std::int8_t>(state);
  s.quality = 87;
  s.frames_received = 1234;
  s.images_flagged = 5;
  s.times_unknown = 17;
  s.images_not_recorded = 23;
  s.can_state = status_t::CAN_BUS_OFF;
  s.memory_pool_bytes = 101'000'000;
  s.build = "0.1.0 abc";
  return s;
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(Top, NobodyHeardIsTheFirstThingSaid) {
  const std::string text = Board().render(10.0, false);
  EXPECT_EQ(text.find("no farpointd heard"), 0U) << text;
}

TEST(Top, ShowsStateRatesAndHealth) {
  Board board;
  for (int i = 0; i <= 60; ++i) {
    const double now_s = 100.0 + i / 30.0;
    odometry_t o{};
    o.valid = 1;
    o.orientation[0] = o.orientation[3] = 0.70710678;  // a quarter turn to the left
    o.position[0] = 12.34;
    o.velocity[0] = 3.0;
    o.velocity[1] = 4.0;
    board.take(o, now_s);
    timing_t t{};
    t.latency_ms = i;
    t.wall_ms[timing_t::STAGE_TRACKING] = 7.0;
    t.resident_bytes = 180'000'000;
    board.take(t, now_s);
    if (i % 6 == 0) board.take(status_of(status_t::STATE_TRACKING), now_s);
  }
  const std::string text = board.render(102.0, false);
  for (const char* part :
       {"TRACKING   quality 87", "odometry 30.0 Hz   status 5.0 Hz", "x 12.34",
        "heading 90.0 deg   speed 5.00 units/s", "p50 30.0  p99 59.0  max 60.0 ms",
        "p50 7.0  p99 7.0  max 7.0 ms", "1234 images", "5 flagged", "17 stamps of no clock",
        "23 not recorded", "CAN       bus off", "180 MB now", "101 MB of it pools", "0.1.0 abc"}) {
    EXPECT_TRUE(has(text, part)) << part << "\n" << text;
  }
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100U) << line;
  EXPECT_FALSE(has(text, "\x1b"));
  EXPECT_TRUE(has(board.render(102.0, true), "\x1b[1;32mTRACKING"));
}

TEST(Top, PairsAreShownWhereThereIsASecondCamera) {
  Board board;
  status_t s = status_of(status_t::STATE_TRACKING);
  board.take(s, 100.0);
  EXPECT_FALSE(has(board.render(100.1, false), "stereo"));
  s.stereo_pairs = 912;
  s.stereo_left_alone = 34;
  s.stereo_right_alone = 5;
  s.stereo_skew_us = -1234;
  board.take(s, 100.2);
  const std::string text = board.render(100.3, false);
  EXPECT_TRUE(has(text, "stereo    912 pairs   34 left alone   5 right alone   skew -1.2 ms\n")) << text;
  s.stereo_pairs = s.stereo_right_alone = 0;  // it never came
  board.take(s, 100.4);
  EXPECT_TRUE(
      has(board.render(100.5, false), "stereo    0 pairs   34 left alone   0 right alone   skew -1.2 ms\n"));
}

TEST(Top, FunctionsThatHaveNotBegunAreNamed) {
  Board board;
  status_t s = status_of(status_t::STATE_TRACKING);
  board.take(s, 100.0);
  EXPECT_FALSE(has(board.render(100.1, false), "attempts failed"));
  s.side_missing = int{status_t::SIDE_LCM} | int{status_t::SIDE_RECORDING};
  s.side_failures = 12;
  board.take(s, 100.2);
  EXPECT_TRUE(has(board.render(100.3, false), "missing   LCM, recording   12 attempts failed\n"));
}

TEST(Top, ADaemonThatFellSilentIsSaidInRed) {
  Board board;
  board.take(status_of(status_t::STATE_TRACKING), 100.0);
  EXPECT_TRUE(has(board.render(107.0, true), "\x1b[1;31mSILENT for 7 s"));
}

TEST(Top, WithoutAPoseNoNumbersAreShown) {
  Board board;
  board.take(status_of(status_t::STATE_NO_CAMERA), 100.0);
  odometry_t o{};
  o.position[0] = 99.0;
  board.take(o, 100.0);
  const std::string text = board.render(100.1, false);
  EXPECT_TRUE(has(text, "NO_CAMERA"));
  EXPECT_TRUE(has(text, "no valid pose"));
  EXPECT_FALSE(has(text, "99.00"));
}

TEST(Top, EveryStateHasItsName) {
  EXPECT_STREQ(state_name(status_t::STATE_STARTING), "starting");
  EXPECT_STREQ(state_name(status_t::STATE_RELOCALISING), "relocalising");
  EXPECT_STREQ(state_name(status_t::STATE_NO_CAMERA), "no_camera");
  EXPECT_STREQ(state_name(99), "?");
  EXPECT_STREQ(can_state_name(status_t::CAN_ABSENT), "absent");
  EXPECT_STREQ(can_state_name(-1), "?");
}

}  // namespace
}  // namespace farpoint::tools
