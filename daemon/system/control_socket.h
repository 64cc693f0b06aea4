// Commands to a running daemon, on a local socket: who may send them is a matter of the file's permissions,
// since LCM's multicast knows no senders. One request a connection, one line each way.
#pragma once

#include <functional>
#include <string>

namespace farpoint::daemon {

class ControlSocket {
 public:
  // Throws std::runtime_error where it cannot be made. What a daemon that was killed has left is replaced;
  // owner and group may connect.
  explicit ControlSocket(const std::string& path);
  ~ControlSocket();
  ControlSocket(const ControlSocket&) = delete;
  ControlSocket& operator=(const ControlSocket&) = delete;

  // Answers who is waiting; does not wait for anyone longer than a moment.
  void serve(const std::function<std::string(const std::string&)>& answer);

 private:
  std::string path_;
  int fd_ = -1;
};

// The other end: sends one request and returns the answer. Throws std::runtime_error saying what is wrong.
[[nodiscard]] std::string ask_daemon(const std::string& path, const std::string& request);

}  // namespace farpoint::daemon
