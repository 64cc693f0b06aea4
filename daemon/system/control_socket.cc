// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/control_socket.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace farpoint::daemon {
namespace {

constexpr std::size_t kMaxRequest = 256, kMaxAnswer = 4096;
constexpr mode_t kOwnerAndGroup = 0660;

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof(address.sun_path))
    throw std::runtime_error(path + ": too long for a socket, expected at most 107 characters");
  path.copy(address.sun_path, path.size());
  return address;
}

void limit_waiting(int fd, int milliseconds) {
  const timeval limit{milliseconds / 1000, milliseconds % 1000 * 1000};
  setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
}

// Removes the socket of a killed daemon. Anything else at this path is left as it is.
void remove_old_socket(const std::string& path) {
  struct stat found {};
  if (lstat(path.c_str(), &found) != 0) return;
  if (!S_ISSOCK(found.st_mode))
    throw std::runtime_error(path + ": not a socket, expected none or the socket of a killed farpointd");
  unlink(path.c_str());
}

// An answer means another daemon, which keeps its socket.
bool is_alive(const sockaddr_un& address) {
  const int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  const bool alive = fd >= 0 && connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  if (fd >= 0) close(fd);
  return alive;
}

}  // namespace

ControlSocket::ControlSocket(const std::string& path) : path_(path) {
  const sockaddr_un address = address_of(path);
  if (is_alive(address)) throw std::runtime_error(path + ": another farpointd answers there");
  remove_old_socket(path);
  fd_ = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const bool bound = fd_ >= 0 && bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  if (bound && chmod(path.c_str(), kOwnerAndGroup) == 0 && listen(fd_, 4) == 0) return;
  const int error = errno;
  if (fd_ >= 0) close(fd_);
  throw std::runtime_error(path + ": no command socket: " + std::strerror(error));
}

ControlSocket::~ControlSocket() {
  close(fd_);
  unlink(path_.c_str());
}

void ControlSocket::serve(const std::function<std::string(const std::string&)>& answer) {
  constexpr int kPatience_ms = 20;
  const int client = accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC);
  if (client < 0) return;
  limit_waiting(client, kPatience_ms);
  std::array<char, kMaxRequest> request;
  const ssize_t got = recv(client, request.data(), request.size(), 0);
  if (got > 0) {
    const std::string text = answer(std::string(request.data(), static_cast<std::size_t>(got)));
    (void)send(client, text.data(), std::min(text.size(), kMaxAnswer), MSG_NOSIGNAL);
  }
  close(client);
}

std::string ask_daemon(const std::string& path, const std::string& request) {
  constexpr int kPatience_ms = 2000;
  const sockaddr_un address = address_of(path);
  const int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  if (fd < 0) throw std::runtime_error(path + ": " + std::strerror(errno));
  limit_waiting(fd, kPatience_ms);
  std::array<char, kMaxAnswer> text;
  ssize_t got = -1;
  if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
      send(fd, request.data(), request.size(), MSG_NOSIGNAL) >= 0)
    got = recv(fd, text.data(), text.size(), 0);
  const int error = errno;
  close(fd);
  if (got < 0) {
    throw std::runtime_error(path + ": " + std::strerror(error) +
                             ", expected a running farpointd and membership of its group");
  }
  return {text.data(), static_cast<std::size_t>(got)};
}

}  // namespace farpoint::daemon
