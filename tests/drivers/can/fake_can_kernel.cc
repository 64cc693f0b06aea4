// SPDX-License-Identifier: Apache-2.0
#include "tests/drivers/can/fake_can_kernel.h"

#include <dlfcn.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cstdarg>
#include <string_view>

namespace farpoint::test {
namespace {

FakeCanKernel* present = nullptr;
constexpr unsigned kIndex = 4242;

}  // namespace

FakeCanKernel::FakeCanKernel() {
  present = this;
}
FakeCanKernel::~FakeCanKernel() {
  present = nullptr;
  if (bus >= 0) close(bus);
}

}  // namespace farpoint::test

using farpoint::test::FakeCanKernel;
using farpoint::test::kIndex;
using farpoint::test::present;

extern "C" {

int socket(int domain, int type, int protocol) noexcept {
  if (present == nullptr || domain != PF_CAN)
    return static_cast<int>(syscall(SYS_socket, domain, type, protocol));
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends.data()) != 0) return -1;
  if (present->bus >= 0) close(present->bus);
  present->bus = ends[1];
  return ends[0];
}

int setsockopt(int fd, int level, int name, const void* value, socklen_t size) noexcept {
  if (present != nullptr && level == SOL_CAN_RAW) return 0;
  return static_cast<int>(syscall(SYS_setsockopt, fd, level, name, value, size));
}

int bind(int fd, const sockaddr* address, socklen_t size) noexcept {
  if (present != nullptr && address->sa_family == AF_CAN) return 0;
  return static_cast<int>(syscall(SYS_bind, fd, address, size));
}

unsigned if_nametoindex(const char* name) noexcept {
  if (present != nullptr && std::string_view(name) == FakeCanKernel::kInterface)
    return present->has_interface ? kIndex : 0;
  using Function = unsigned (*)(const char*);
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, "if_nametoindex"))(name);
}

int ioctl(int fd, unsigned long request, ...) noexcept {
  va_list arguments;
  va_start(arguments, request);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);
  if (present != nullptr && request == SIOCGIFMTU) {
    static_cast<ifreq*>(argument)->ifr_mtu = present->mtu;
    return 0;
  }
  return static_cast<int>(syscall(SYS_ioctl, fd, request, argument));
}

}  // extern "C"
