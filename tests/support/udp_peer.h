// SPDX-License-Identifier: Apache-2.0
// The other end of a UDP link: a socket of the loopback interface, on a free port.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace farpoint::test {

class UdpPeer {
 public:
  UdpPeer() : fd_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    EXPECT_EQ(::bind(fd_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(::getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    address_ = "udp:127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  }
  ~UdpPeer() { ::close(fd_); }
  UdpPeer(const UdpPeer&) = delete;
  UdpPeer& operator=(const UdpPeer&) = delete;

  // As the key mavlink.link has it.
  [[nodiscard]] const std::string& address() const { return address_; }

  // The next datagram; empty where none comes in time.
  [[nodiscard]] std::vector<std::uint8_t> receive(int patience_ms) {
    constexpr std::size_t kMostBytes = 600;
    pollfd descriptor{fd_, POLLIN, 0};
    if (::poll(&descriptor, 1, patience_ms) != 1) return {};
    std::vector<std::uint8_t> bytes(kMostBytes);
    socklen_t size = sizeof(from_);
    const ssize_t count =
        ::recvfrom(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&from_), &size);
    bytes.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
    return bytes;
  }
  // Sends to whom the last datagram came from. False where that fails.
  bool answer(std::span<const std::uint8_t> bytes) const {
    return ::sendto(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&from_),
                    sizeof(from_)) > 0;
  }

 private:
  int fd_;
  std::string address_;
  sockaddr_in from_{};
};

}  // namespace farpoint::test
