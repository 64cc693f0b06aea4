// SPDX-License-Identifier: Apache-2.0
#include "tools/top/board.h"

#include <gtest/gtest.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "ipc/reason.h"
#include "tests/tools/tool_support.h"

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
        "p50 7.0  p99 7.0  max 7.0 ms", "1234 in", "5 flagged", "17 stamps of no clock", "23 not recorded",
        "CAN       bus off", "180 MB now", "101 MB of it pools", "0.1.0 abc"}) {
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

TEST(Top, TheMetresSourceAndTheWheelsAreShown) {
  Board board;
  status_t s = status_of(status_t::STATE_TRACKING);
  board.take(s, 100.0);
  EXPECT_TRUE(has(board.render(100.1, false), "scale unknown   map"));
  EXPECT_FALSE(has(board.render(100.1, false), "wheels"));
  s.wheels = status_t::WHEELS_STARTING;
  board.take(s, 100.2);
  EXPECT_TRUE(has(board.render(100.3, false), "wheels    not judged yet\n"));
  s.wheels = status_t::WHEELS_USED;
  s.scale_state = status_t::SCALE_METRIC;
  s.metre_source = status_t::METRE_WHEELS;
  board.take(s, 100.4);
  EXPECT_TRUE(has(board.render(100.5, false), "scale metric by wheels   map"));
  EXPECT_TRUE(has(board.render(100.5, false), "wheels    used\n"));
  s.wheels = status_t::WHEELS_CONTRADICTED;
  s.metre_source = status_t::METRE_CAMERAS;
  board.take(s, 100.6);
  EXPECT_TRUE(has(board.render(100.7, false), "scale metric by two cameras   map"));
  EXPECT_TRUE(has(board.render(100.7, false), "wheels    contradict the images, not used\n"));
}

TEST(Top, MavlinkIsShownWhereItRuns) {
  Board board;
  status_t s = status_of(status_t::STATE_TRACKING);
  s.mavlink_round_trip_us = -1;
  board.take(s, 100.0);
  EXPECT_FALSE(has(board.render(100.1, false), "MAVLink"));
  s.mavlink_without_scale = 60;
  s.side_missing = int{status_t::SIDE_MAVLINK};
  board.take(s, 100.2);
  const std::string held = board.render(100.3, false);
  EXPECT_TRUE(has(held, "MAVLink   0 sent   60 without metres   0 without pose   0 errors   no answer\n"))
      << held;
  EXPECT_TRUE(has(held, "missing   MAVLink   0 attempts failed\n")) << held;
  s.mavlink_sent = 900;
  s.mavlink_round_trip_us = 1234;
  board.take(s, 100.4);
  EXPECT_TRUE(has(board.render(100.5, false),
                  "MAVLink   900 sent   60 without metres   0 without pose   0 errors   "
                  "round trip 1234 us\n"));
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

TEST(Top, TheCameraIsNamedWithFormatRateAndExposure) {
  Board board;
  status_t s = status_of(status_t::STATE_TRACKING);
  board.take(s, 100.0);
  EXPECT_FALSE(has(board.render(100.1, false), "camera    "));
  s.camera = "usb:1-1";
  s.camera_exposure_us = -1;
  s.camera_gain = -1.0;
  board.take(s, 100.2);
  EXPECT_TRUE(has(board.render(100.3, false), "camera    usb:1-1   exposure unknown\n"));
  s.camera_format = "YUYV";
  s.camera_rate_hz = 30.0;
  s.camera_exposure_us = 4500;
  s.camera_gain = 12.0;
  board.take(s, 100.4);
  EXPECT_TRUE(
      has(board.render(100.5, false), "camera    usb:1-1   YUYV at 30 Hz   exposure 4.5 ms   gain 12\n"));
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

TEST(Top, AStatusWithAReasonShowsItsSentence) {
  Board board;
  status_t s = status_of(status_t::STATE_INITIALISING);
  s.reason = static_cast<std::int8_t>(ipc::Reason::kLittleParallax);
  s.reason_value = 0.004, s.reason_wanted = 0.0175;
  board.take(s, 100.0);
  EXPECT_TRUE(has(board.render(100.1, false), "reason    waiting for sideways motion: 0.0040 of 0.0175 rad"));
  s.reason = static_cast<std::int8_t>(ipc::Reason::kNoCamera);
  board.take(s, 100.2);
  EXPECT_TRUE(has(board.render(100.3, false), "reason    no camera"));
}

TEST(Top, AValidStateHasNoReason) {
  Board board;
  odometry_t o{};
  o.valid = 1;
  board.take(status_of(status_t::STATE_TRACKING), 100.0);
  EXPECT_TRUE(has(board.render(100.1, false), "reason    no odometry received"));
  board.take(o, 100.0);
  EXPECT_FALSE(has(board.render(100.1, false), "reason"));
  EXPECT_TRUE(has(board.render(100.6, false), "reason    no pose in time: the last odometry came 0.6 s ago"));
  status_t s = status_of(status_t::STATE_TRACKING);
  s.message = "the calibration contradicts the images";
  board.take(s, 100.7);
  EXPECT_TRUE(has(board.render(100.7, false), "reason    the calibration contradicts"));
}

TEST(Top, TimeSinceTheLastValidPoseIsShown) {
  Board board;
  board.take(status_of(status_t::STATE_LOST), 100.0);
  EXPECT_TRUE(has(board.render(103.2, false), "no valid pose since top began to listen, 3 s ago"));
  odometry_t o{};
  o.valid = 1;
  board.take(o, 104.0);
  o.valid = 0;
  board.take(o, 109.0);
  EXPECT_TRUE(has(board.render(110.5, false), "last valid pose 6.5 s ago"));
}

TEST(Top, SigmasAreShownWhereTheyAreKnown) {
  Board board;
  board.take(status_of(status_t::STATE_TRACKING), 100.0);
  odometry_t o{};
  o.valid = 1;
  o.scale_state = status_t::SCALE_ASSUMED;
  for (int i = 0; i < 6; ++i) o.pose_covariance[i][i] = o.twist_covariance[i][i] = NAN;
  board.take(o, 100.0);
  EXPECT_TRUE(has(board.render(100.1, false), "sigma     position -   attitude -   velocity -\n"));
  for (int i = 0; i < 3; ++i) o.pose_covariance[i][i] = 0.03;  // 0.3 m in all
  for (int i = 3; i < 6; ++i) o.pose_covariance[i][i] = 1.0 / 3.0 / 57.29577951308232 / 57.29577951308232;
  for (int i = 0; i < 3; ++i) o.twist_covariance[i][i] = 0.0012;
  board.take(o, 100.2);
  EXPECT_TRUE(
      has(board.render(100.3, false), "sigma     position 0.3 m   attitude 1 deg   velocity 0.06 m/s\n"))
      << board.render(100.3, false);
}

TEST(Top, CpuAndImageRateAreOfTheLastSeconds) {
  Board board;
  for (int i = 0; i <= 40; ++i) {
    const double now_s = 100.0 + 0.1 * i;
    timing_t t{};
    t.process_cpu_s = 7.0 + 0.03 * i;
    board.take(t, now_s);
    status_t s = status_of(status_t::STATE_TRACKING);
    s.frames_received = 1000 + 3 * i;
    board.take(s, now_s);
  }
  const std::string text = board.render(104.0, false);
  EXPECT_TRUE(has(text, "CPU       30 % of one core")) << text;
  EXPECT_TRUE(has(text, "images 30.0 Hz")) << text;
  // A daemon that starts again counts from zero.
  status_t s = status_of(status_t::STATE_TRACKING);
  s.frames_received = 3;
  board.take(s, 104.1);
  timing_t t{};
  t.process_cpu_s = 0.1;
  board.take(t, 104.1);
  const std::string again = board.render(104.2, false);
  EXPECT_TRUE(has(again, "images 0.0 Hz") && has(again, "CPU       -\n")) << again;
}

TEST(Top, PointsAreLandmarksWithADepth) {
  Board board;
  status_t s = status_of(status_t::STATE_TRACKING);
  s.keyframes = 12;
  s.landmarks = 1500;
  s.vmps = 266;
  board.take(s, 100.0);
  EXPECT_TRUE(has(board.render(100.1, false), "map       12 keyframes   1234 points   266 virtual points"));
}

TEST(Top, ABusThatIsNotInUseIsOff) {
  status_t s{};
  EXPECT_STREQ(bus_text(s), "off");
  Board board;
  board.take(s, 100.0);
  EXPECT_TRUE(has(board.render(100.1, false), "CAN       off\n"));
  s.can_send_errors = 1;  // in use, and no frame has gone out yet
  EXPECT_STREQ(bus_text(s), "unknown");
  s.can_state = status_t::CAN_ACTIVE;
  EXPECT_STREQ(bus_text(s), "active");
}

// The program on a terminal of its own.
TEST(Top, LeavesWhenQIsPressed) {
  int terminal = -1;
  const std::string path = program();
  const pid_t child = forkpty(&terminal, nullptr, nullptr, nullptr);
  ASSERT_GE(child, 0);
  if (child == 0) {
    // Ends by itself after half a minute if the key does nothing.
    execl(path.c_str(), path.c_str(), "top", "--lcm-url", "memq://", "--seconds", "30", nullptr);
    _exit(127);
  }
  std::string seen;
  std::array<char, 4096> part{};
  bool pressed = false;
  // The end of the child ends the terminal.
  for (ssize_t got = 0; (got = read(terminal, part.data(), part.size())) > 0;) {
    seen.append(part.data(), static_cast<std::size_t>(got));
    if (!pressed && has(seen, "q: leave")) {
      pressed = true;
      EXPECT_EQ(write(terminal, "xq", 2), 2);
    }
  }
  close(terminal);
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << seen;
  EXPECT_TRUE(pressed) << seen;
  EXPECT_LT(std::count(seen.begin(), seen.end(), 'H'), 60) << "29 s of pictures more";
  EXPECT_FALSE(has(seen, "xq")) << "keys are not echoed";
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
