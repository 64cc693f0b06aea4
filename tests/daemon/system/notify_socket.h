// SPDX-License-Identifier: Apache-2.0
// A service manager's end of the notification socket.
#pragma once

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "daemon/system/stage_clock.h"

namespace farpoint::test {

class NotifySocket {
 public:
  NotifySocket(const std::string& path, int watchdog_us)
      : fd_(socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof(address.sun_path) - 1);
    EXPECT_EQ(bind(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    setenv("NOTIFY_SOCKET", path.c_str(), 1);
    setenv("WATCHDOG_USEC", std::to_string(watchdog_us).c_str(), 1);
  }
  ~NotifySocket() {
    close(fd_);
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
  }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;

  void read_all() {
    char text[512];
    for (ssize_t got = 0; (got = recv(fd_, text, sizeof text, 0)) > 0;)
      messages.emplace_back(daemon::steady_s(), std::string(text, static_cast<std::size_t>(got)));
  }
  [[nodiscard]] int count(const std::string& start) const {
    return static_cast<int>(std::count_if(messages.begin(), messages.end(),
                                          [&](const auto& m) { return m.second.starts_with(start); }));
  }
  std::vector<std::pair<double, std::string>> messages;

 private:
  int fd_;
};

}  // namespace farpoint::test
