// SPDX-License-Identifier: Apache-2.0
// A bus that is not ready when the daemon starts is waited for, with a kernel that can be made so.
#include <gtest/gtest.h>
#include <linux/can.h>
#include <unistd.h>

#include <array>
#include <stdexcept>
#include <string>

#include "drivers/can/socketcan.h"
#include "tests/drivers/can/fake_can_kernel.h"

namespace farpoint::drivers {
namespace {

using test::FakeCanKernel;

CanOptions live(bool fd) {
  CanOptions options;
  options.fd = fd;
  options.wait_for_interface = true;
  options.confirm = true;
  options.sent_ids = {0x680};
  return options;
}

TEST(SocketCanStart, AnInterfaceWhoseFdIsSetUpLaterIsWaitedFor) {
  FakeCanKernel kernel;
  SocketCan can(FakeCanKernel::kInterface, live(true));
  EXPECT_EQ(can.state(), CanState::kAbsent);
  EXPECT_NE(std::string(can.waits_for()).find("no CAN FD"), std::string::npos);
  can.maintain();
  EXPECT_EQ(can.state(), CanState::kAbsent);
  kernel.mtu = CANFD_MTU;  // ip link set ... fd on
  can.maintain();
  EXPECT_STREQ(can.waits_for(), "");
  EXPECT_TRUE(can.confirms());
  ipc::CanFrame frame;
  frame.id = 0x680;
  frame.size = 64;
  EXPECT_TRUE(can.send({&frame, 1}));
  canfd_frame got{};
  EXPECT_EQ(read(kernel.bus, &got, sizeof got), static_cast<ssize_t>(CANFD_MTU));
  EXPECT_EQ(got.len, 64);
  EXPECT_EQ(can.in_flight(), 1);
}

TEST(SocketCanStart, WhereItIsNotWaitedForItIsAnError) {
  FakeCanKernel kernel;
  CanOptions options;
  options.fd = true;
  EXPECT_THROW(SocketCan(FakeCanKernel::kInterface, options), std::runtime_error);
}

TEST(SocketCanStart, AnInterfaceThatComesLaterIsTaken) {
  FakeCanKernel kernel;
  kernel.has_interface = false;
  SocketCan can(FakeCanKernel::kInterface, live(false));
  EXPECT_NE(std::string(can.waits_for()).find("no such interface"), std::string::npos);
  kernel.has_interface = true;
  can.maintain();
  EXPECT_STREQ(can.waits_for(), "");
  EXPECT_EQ(can.counts().reopened, 1U);
}

}  // namespace
}  // namespace farpoint::drivers
