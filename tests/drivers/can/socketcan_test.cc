// SPDX-License-Identifier: Apache-2.0
#include "drivers/can/socketcan.h"

#include <gtest/gtest.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>

namespace farpoint::drivers {
namespace {

bool kernel_has_can() {
  const int fd = socket(PF_CAN, SOCK_RAW, CAN_RAW);
  if (fd >= 0) close(fd);
  return fd >= 0;
}

std::string error_of(const std::string& interface) {
  try {
    SocketCan can(interface);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return {};
}

// On a real interface: tools/hil, whose guest has vcan.
TEST(SocketCan, AnErrorSaysWhatIsMissing) {
  const std::string error = error_of("nocan0");
  EXPECT_NE(error.find("nocan0"), std::string::npos) << error;
  EXPECT_NE(error.find(kernel_has_can() ? "no such interface" : "kernel has no CAN"), std::string::npos)
      << error;
}

// The other end of the socket stands for the bus.
class SocketCanPair : public testing::Test {
 protected:
  SocketCanPair() { open({}); }
  void open(const CanOptions& options) {
    if (bus_ >= 0) close(bus_);
    std::array<int, 2> ends{};
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0, ends.data()), 0);
    can_ = std::make_unique<SocketCan>(ends[0], options);
    bus_ = ends[1];
  }
  void TearDown() override {
    if (bus_ >= 0) close(bus_);
  }
  void error(std::uint32_t kinds, std::uint8_t controller = 0) {
    can_frame f{};
    f.can_id = CAN_ERR_FLAG | kinds;
    f.len = CAN_ERR_DLC;
    f.data[1] = controller;
    ASSERT_EQ(write(bus_, &f, sizeof f), static_cast<ssize_t>(sizeof f));
    ipc::CanFrame frame;
    std::int64_t age_us = 0;
    EXPECT_FALSE(can_->receive(&frame, &age_us));  // no data
  }

  std::unique_ptr<SocketCan> can_;
  int bus_ = -1;
};

TEST_F(SocketCanPair, FramesGoThroughBothWays) {
  const std::array<ipc::CanFrame, 2> frames{{{0x301, 8, {1, 2, 3}}, {0x302, 2, {9, 8}}}};
  EXPECT_TRUE(can_->send(frames));
  can_frame got{};
  ASSERT_EQ(read(bus_, &got, sizeof got), static_cast<ssize_t>(sizeof got));
  EXPECT_EQ(got.can_id, 0x301U);
  EXPECT_EQ(got.data[2], 3);
  EXPECT_EQ(can_->state(), CanState::kActive);
  got.can_id = 0x120;
  got.len = 4;
  ASSERT_EQ(write(bus_, &got, sizeof got), static_cast<ssize_t>(sizeof got));
  got.can_id = 0x120 | CAN_EFF_FLAG;
  ASSERT_EQ(write(bus_, &got, sizeof got), static_cast<ssize_t>(sizeof got));
  ipc::CanFrame frame;
  std::int64_t age_us = 0;
  ASSERT_TRUE(can_->receive(&frame, &age_us));
  EXPECT_EQ(frame.id, 0x120U);
  EXPECT_EQ(frame.size, 4);
  EXPECT_FALSE(can_->receive(&frame, &age_us));  // extended: passed over
}

TEST_F(SocketCanPair, CanFdFramesGoThroughBothWaysBesideClassicOnes) {
  CanOptions options;
  options.fd = true;
  open(options);
  const std::array<ipc::CanFrame, 1> frames{{{0x301, 8, {1, 2, 3}}}};
  EXPECT_TRUE(can_->send(frames));
  canfd_frame got{};
  ASSERT_EQ(read(bus_, &got, sizeof got), static_cast<ssize_t>(CANFD_MTU));
  EXPECT_EQ(got.can_id, 0x301U);
  EXPECT_EQ(got.len, 8);
  EXPECT_EQ(got.flags & CANFD_BRS, CANFD_BRS);
  EXPECT_EQ(got.data[2], 3);

  ipc::CanFrame frame;
  std::int64_t age_us = 0;
  got.can_id = 0x123;
  got.len = 64;
  got.data[63] = 7;
  ASSERT_EQ(write(bus_, &got, CANFD_MTU), static_cast<ssize_t>(CANFD_MTU));
  ASSERT_TRUE(can_->receive(&frame, &age_us));
  EXPECT_EQ(frame.size, 64);
  EXPECT_EQ(frame.data[63], 7);
  can_frame classic{};
  classic.can_id = 0x124;
  classic.len = 2;
  classic.data[1] = 9;
  ASSERT_EQ(write(bus_, &classic, sizeof classic), static_cast<ssize_t>(sizeof classic));
  ASSERT_TRUE(can_->receive(&frame, &age_us));
  EXPECT_EQ(frame.id, 0x124U);
  EXPECT_EQ(frame.size, 2);
  EXPECT_EQ(frame.data[1], 9);
  EXPECT_EQ(frame.data[63], 0);  // nothing is left of the frame before
}

TEST_F(SocketCanPair, AFrameHasTheTimeAtWhichItArrivedNotThatAtWhichItIsRead) {
  can_frame out{};
  out.can_id = 0x120;
  ASSERT_EQ(write(bus_, &out, sizeof out), static_cast<ssize_t>(sizeof out));
  const auto began = std::chrono::steady_clock::now();
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  ipc::CanFrame frame;
  std::int64_t age_us = 0;
  ASSERT_TRUE(can_->receive(&frame, &age_us));
  const auto waited = std::chrono::steady_clock::now() - began;
  EXPECT_GE(age_us, 20'000);
  EXPECT_LE(age_us, std::chrono::duration_cast<std::chrono::microseconds>(waited).count() + 1000);
}

TEST_F(SocketCanPair, TheControllersNewsBecomeItsState) {
  error(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_WARNING);
  EXPECT_EQ(can_->state(), CanState::kWarning);
  error(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE);
  EXPECT_EQ(can_->state(), CanState::kPassive);
  error(CAN_ERR_BUSOFF);
  EXPECT_EQ(can_->state(), CanState::kBusOff);
  error(CAN_ERR_RESTARTED);
  EXPECT_EQ(can_->state(), CanState::kActive);
  EXPECT_EQ(can_->counts().error_frames, 4U);
  EXPECT_EQ(can_->counts().bus_off, 1U);
}

TEST_F(SocketCanPair, AFullQueueIsCountedAndSurvived) {
  const std::array<ipc::CanFrame, 1> frame{{{0x301, 8, {}}}};
  int sent = 0;
  while (can_->send(frame) && sent < 100'000) ++sent;
  EXPECT_GT(sent, 0);
  EXPECT_EQ(can_->counts().queue_full, 1U);
  EXPECT_EQ(can_->counts().not_sent, 1U);
  can_frame got{};
  while (read(bus_, &got, sizeof got) > 0) {
  }
  EXPECT_TRUE(can_->send(frame));
}

TEST_F(SocketCanPair, AFrameIsInFlightUntilTheControllerConfirmsIt) {
  CanOptions options;
  options.confirm = true;
  open(options);
  const std::array<ipc::CanFrame, 2> frames{{{0x680, 8, {1}}, {0x681, 8, {2}}}};
  EXPECT_TRUE(can_->send(frames));
  EXPECT_EQ(can_->in_flight(), 2);
  ipc::CanFrame frame;
  std::int64_t age_us = 0;
  EXPECT_FALSE(can_->take_confirmed(&frame, &age_us));
  can_frame echo{};
  ASSERT_EQ(read(bus_, &echo, sizeof echo), static_cast<ssize_t>(sizeof echo));
  ASSERT_EQ(write(bus_, &echo, sizeof echo), static_cast<ssize_t>(sizeof echo));
  ASSERT_TRUE(can_->take_confirmed(&frame, &age_us));
  EXPECT_EQ(frame.id, 0x680U);
  EXPECT_EQ(can_->in_flight(), 1);
  EXPECT_EQ(can_->counts().confirmed, 1U);
}

// The kernel drops the queue: waiting for its confirmation would silence the bus without end.
TEST_F(SocketCanPair, AfterTheControllerStartedAnewNothingIsInFlight) {
  CanOptions options;
  options.confirm = true;
  open(options);
  const std::array<ipc::CanFrame, 1> frames{{{0x680, 8, {1}}}};
  EXPECT_TRUE(can_->send(frames));
  const auto tell = [&](std::uint32_t kinds) {
    can_frame f{};
    f.can_id = CAN_ERR_FLAG | kinds;
    f.len = CAN_ERR_DLC;
    ASSERT_EQ(write(bus_, &f, sizeof f), static_cast<ssize_t>(sizeof f));
    ipc::CanFrame frame;
    std::int64_t age_us = 0;
    EXPECT_FALSE(can_->take_confirmed(&frame, &age_us));
  };
  tell(CAN_ERR_BUSOFF);
  EXPECT_EQ(can_->in_flight(), 1);
  tell(CAN_ERR_RESTARTED);
  EXPECT_EQ(can_->in_flight(), 0);
}

TEST_F(SocketCanPair, IdentifiersOf29BitsAreSentAsSuch) {
  std::array<ipc::CanFrame, 1> frames{{{0x18ff1000, 8, {1}}}};
  frames[0].extended = true;
  EXPECT_TRUE(can_->send(frames));
  can_frame got{};
  ASSERT_EQ(read(bus_, &got, sizeof got), static_cast<ssize_t>(sizeof got));
  EXPECT_EQ(got.can_id, 0x18ff1000U | CAN_EFF_FLAG);
}

}  // namespace
}  // namespace farpoint::drivers
