// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/wheel_source.h"

#include <gtest/gtest.h>
#include <linux/can.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <fstream>
#include <thread>

#include "daemon/system/stage_clock.h"
#include "tests/ipc/scratch.h"

namespace farpoint::daemon {
namespace {

TEST(WheelSource, SpeedsComeInOnItsOwnThreadWithTheTimeOfTheirArrival) {
  const test::Scratch scratch;
  std::ofstream(scratch.path("a.dbc")) << "BO_ 291 W: 8 ABS\n SG_ L : 0|16@1+ (0.01,0) [0|600] \"km/h\"  X\n";
  std::array<int, 2> ends{};
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0, ends.data()), 0);
  WheelSource source(std::make_unique<drivers::SocketCan>(ends[0], drivers::CanOptions{}),
                     drivers::WheelReader(scratch.path("a.dbc"), "W.L"));
  EXPECT_EQ(source.front(), nullptr);
  can_frame out{};
  out.can_id = 291;
  out.len = 8;
  out.data[0] = 0x10;
  out.data[1] = 0x0E;  // 36 km/h
  const double sent_s = steady_s();
  ASSERT_EQ(write(ends[1], &out, sizeof out), static_cast<ssize_t>(sizeof out));
  std::this_thread::sleep_for(std::chrono::milliseconds(20));  // the thread comes late
  std::thread thread([&] { source.run(); });
  while (source.front() == nullptr && steady_s() < sent_s + 5.0) std::this_thread::yield();
  const wheels_t* wheels = source.front();
  ASSERT_NE(wheels, nullptr);
  EXPECT_NEAR(wheels->speed, 10.0, 1e-9);
  EXPECT_NEAR(1e-6 * static_cast<double>(wheels->utime), sent_s, 0.005);
  EXPECT_EQ(source.received(), 1);
  source.pop();
  EXPECT_EQ(source.front(), nullptr);
  source.stop();
  thread.join();
  close(ends[1]);
}

}  // namespace
}  // namespace farpoint::daemon
