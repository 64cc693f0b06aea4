// SPDX-License-Identifier: Apache-2.0
// A CAN interface for a program that is started with this library in LD_PRELOAD. Its CAN socket is connected
// to the Unix socket (SOCK_SEQPACKET) that FARPOINT_FAKE_BUS names; what the other end sends back counts as
// confirmed by the controller. All other calls pass.
#include <dlfcn.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdlib>
#include <string>
#include <string_view>

namespace {

constexpr unsigned kIndex = 4242;
constexpr std::string_view kInterface = "fakecan0";
constexpr int kClassicMtu = 16;

std::atomic<int> bus_fd{-1};

int connect_to_bus() {
  const char* path = std::getenv("FARPOINT_FAKE_BUS");
  if (path == nullptr) {
    errno = EPROTONOSUPPORT;
    return -1;
  }
  const int fd =
      static_cast<int>(syscall(SYS_socket, AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::string_view(path).copy(address.sun_path, sizeof(address.sun_path) - 1);
  if (fd < 0 || connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return -1;
  bus_fd = fd;
  return fd;
}

}  // namespace

extern "C" {

int socket(int domain, int type, int protocol) noexcept {
  if (domain != PF_CAN) return static_cast<int>(syscall(SYS_socket, domain, type, protocol));
  return connect_to_bus();
}

int setsockopt(int fd, int level, int name, const void* value, socklen_t size) noexcept {
  if (level == SOL_CAN_RAW) return 0;
  return static_cast<int>(syscall(SYS_setsockopt, fd, level, name, value, size));
}

int bind(int fd, const sockaddr* address, socklen_t size) noexcept {
  if (address->sa_family == AF_CAN) return 0;
  return static_cast<int>(syscall(SYS_bind, fd, address, size));
}

ssize_t recvmsg(int fd, msghdr* message, int flags) {
  const ssize_t got = syscall(SYS_recvmsg, fd, message, flags);
  if (got > 0 && fd == bus_fd) message->msg_flags |= MSG_CONFIRM;
  return got;
}

unsigned if_nametoindex(const char* name) noexcept {
  if (name == kInterface) return kIndex;
  using Function = unsigned (*)(const char*);
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, "if_nametoindex"))(name);
}

int ioctl(int fd, unsigned long request, ...) noexcept {
  va_list arguments;
  va_start(arguments, request);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);
  if (request == SIOCGIFMTU) {
    static_cast<ifreq*>(argument)->ifr_mtu = kClassicMtu;
    return 0;
  }
  return static_cast<int>(syscall(SYS_ioctl, fd, request, argument));
}

}  // extern "C"
