// SPDX-License-Identifier: Apache-2.0
// Commands to a running daemon on a local socket. File permissions control access, since LCM multicast is not
// authenticated. One request a connection, one line each way.
#pragma once

#include <functional>
#include <string>

namespace farpoint::daemon {

class ControlSocket {
 public:
  // Throws std::runtime_error if the socket cannot be created. Replaces the socket of a killed daemon; never
  // removes anything else. Owner and group may connect.
  explicit ControlSocket(const std::string& path);
  ~ControlSocket();
  ControlSocket(const ControlSocket&) = delete;
  ControlSocket& operator=(const ControlSocket&) = delete;

  // Answers waiting clients. Waits only a moment for each.
  void serve(const std::function<std::string(const std::string&)>& answer);

 private:
  std::string path_;
  int fd_ = -1;
};

// Client: sends one request and returns the answer. Throws std::runtime_error with the reason.
[[nodiscard]] std::string ask_daemon(const std::string& path, const std::string& request);

}  // namespace farpoint::daemon
