// SPDX-License-Identifier: Apache-2.0
// A UDP socket of the loopback interface and a pseudo terminal stand in for the autopilot.
#include "drivers/mavlink/mavlink_link.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <string>
#include <vector>

#include "tests/support/udp_peer.h"

namespace farpoint::drivers {
namespace {

constexpr int kPatience_ms = 2000;
const std::vector<std::uint8_t> kMessage{1, 2, 3, 250, 17, 19};

std::vector<std::uint8_t> wait_and_receive(MavlinkLink* link) {
  pollfd descriptor{link->fd(), POLLIN, 0};
  (void)::poll(&descriptor, 1, 2000);
  std::array<std::uint8_t, 300> room{};
  const auto bytes = link->receive(room);
  return {bytes.begin(), bytes.end()};
}

TEST(MavlinkAddress, WhatIsNoAddressIsRefused) {
  for (const char* good : {"udp:127.0.0.1:14580", "udp:10.0.0.2:14580:14540", "serial:/dev/ttyS1:921600",
                           "serial:/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0:57600"})
    EXPECT_EQ(MavlinkAddress::check(good), "") << good;
  for (const char* bad : {"", "udp:", "udp:localhost:14580", "udp:127.0.0.1", "udp:127.0.0.1:0",
                          "udp:1.2.3.4:70000", "udp:1.2.3.4:1:2:3", "udp:1.2.3.4:1x", "tcp:127.0.0.1:5760",
                          "serial:/dev/ttyS1", "serial:/dev/ttyS1:12345", "serial::57600", "/dev/ttyS1"})
    EXPECT_NE(MavlinkAddress::check(bad), "") << bad;
  const MavlinkAddress address =
      MavlinkAddress::parse("serial:/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0:57600");
  EXPECT_EQ(address.host, "/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0");
  EXPECT_EQ(address.port, 57600);
}

TEST(MavlinkLink, UdpGoesBothWays) {
  test::UdpPeer peer;
  MavlinkLink link(MavlinkAddress::parse(peer.address()));
  EXPECT_FALSE(link.send(kMessage));  // not open
  ASSERT_EQ(link.open(), "");
  std::array<std::uint8_t, 10> room{};
  EXPECT_TRUE(link.receive(room).empty());  // at once
  EXPECT_TRUE(link.send(kMessage));
  EXPECT_EQ(peer.receive(kPatience_ms), kMessage);
  EXPECT_TRUE(peer.answer(std::vector<std::uint8_t>{9, 8, 7}));
  EXPECT_EQ(wait_and_receive(&link), (std::vector<std::uint8_t>{9, 8, 7}));
  EXPECT_EQ(link.counts().sent, 1U);
  EXPECT_EQ(link.counts().not_sent, 1U);
}

TEST(MavlinkLink, AUdpPortWithoutListenerIsCountedAndServedOnceThereIsOne) {
  const std::string address = test::UdpPeer().address();  // gone
  MavlinkLink link(MavlinkAddress::parse(address));
  ASSERT_EQ(link.open(), "");
  for (int i = 0; i < 20; ++i) {
    (void)link.send(kMessage);
    ::usleep(1000);
  }
  EXPECT_GT(link.counts().not_sent, 0U);
  EXPECT_EQ(link.counts().last_errno, ECONNREFUSED);
  EXPECT_TRUE(link.is_open());
}

// A pseudo terminal: the test holds the other end.
class Terminal {
 public:
  Terminal() : fd(::posix_openpt(O_RDWR | O_NOCTTY)) {
    EXPECT_EQ(::grantpt(fd), 0);
    EXPECT_EQ(::unlockpt(fd), 0);
    name = ::ptsname(fd);
  }
  ~Terminal() { hang_up(); }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  void hang_up() {
    if (fd >= 0) ::close(fd);
    fd = -1;
  }
  int fd;
  std::string name;
};

TEST(MavlinkLink, ASerialPortIsRawAndOfTheRightSpeed) {
  Terminal terminal;
  MavlinkLink link(MavlinkAddress::parse("serial:" + terminal.name + ":921600"));
  ASSERT_EQ(link.open(), "");
  termios settings{};
  ASSERT_EQ(tcgetattr(link.fd(), &settings), 0);
  EXPECT_EQ(cfgetospeed(&settings), static_cast<speed_t>(B921600));
  EXPECT_EQ(settings.c_lflag & (ICANON | ECHO | ISIG), 0U);
  EXPECT_EQ(settings.c_oflag & OPOST, 0U);
  const std::vector<std::uint8_t> special{0x0A, 0x0D, 0x03, 0x11, 0x13, 0xFD, 0x00, 0x7F};
  EXPECT_TRUE(link.send(special));
  std::vector<std::uint8_t> came(special.size());
  EXPECT_EQ(::read(terminal.fd, came.data(), came.size()), static_cast<ssize_t>(special.size()));
  EXPECT_EQ(came, special);
  EXPECT_EQ(::write(terminal.fd, special.data(), special.size()), static_cast<ssize_t>(special.size()));
  EXPECT_EQ(wait_and_receive(&link), special);
}

TEST(MavlinkLink, AFullSerialPortDropsAndNeverWaits) {
  Terminal terminal;
  MavlinkLink link(MavlinkAddress::parse("serial:" + terminal.name + ":57600"));
  ASSERT_EQ(link.open(), "");
  const std::vector<std::uint8_t> message(250, 7);
  for (int i = 0; i < 2000; ++i) (void)link.send(message);
  EXPECT_GT(link.counts().not_sent, 100U);
  EXPECT_TRUE(link.is_open());
}

TEST(MavlinkLink, ASerialPortThatIsGoneIsClosedAndOpenedAnew) {
  Terminal terminal;
  MavlinkLink link(MavlinkAddress::parse("serial:" + terminal.name + ":57600"));
  ASSERT_EQ(link.open(), "");
  terminal.hang_up();
  EXPECT_FALSE(link.send(kMessage));
  EXPECT_FALSE(link.is_open());
  EXPECT_NE(link.open(), "");
  EXPECT_FALSE(link.send(kMessage));
  EXPECT_EQ(link.counts().not_sent, 2U);
}

}  // namespace
}  // namespace farpoint::drivers
