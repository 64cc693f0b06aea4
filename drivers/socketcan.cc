#include "drivers/socketcan.h"

#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace farpoint::drivers {
namespace {

// Without a kernel that has CAN, socket() fails with one of these.
bool is_no_can(int error) {
  return error == EAFNOSUPPORT || error == EPROTONOSUPPORT || error == EINVAL;
}

[[noreturn]] void fail(const std::string& interface, const std::string& why) {
  throw std::runtime_error("cannot use CAN interface " + interface + ": " + why);
}

int open_socket(const std::string& interface) {
  const int fd = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (fd < 0 && is_no_can(errno))
    fail(interface, "this kernel has no CAN (modules can and can_raw are needed)");
  if (fd < 0) fail(interface, std::strerror(errno));
  return fd;
}

// Empty on success.
std::string bind_to(int fd, const std::string& interface) {
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
  if (address.can_ifindex == 0) return "no such interface (see: ip link show type can)";
  if (bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return std::strerror(errno);
  return {};
}

can_frame to_kernel(const ipc::CanFrame& frame) {
  can_frame out{};
  out.can_id = frame.id & CAN_SFF_MASK;
  out.len = std::min<std::uint8_t>(frame.size, CAN_MAX_DLEN);
  std::copy_n(frame.data.begin(), out.len, out.data);
  return out;
}

}  // namespace

SocketCan::SocketCan(const std::string& interface) : fd_(open_socket(interface)) {
  const std::string error = bind_to(fd_, interface);
  if (!error.empty()) {
    close(fd_);
    fail(interface, error);
  }
}

SocketCan::~SocketCan() {
  close(fd_);
}

bool SocketCan::send(std::span<const ipc::CanFrame> frames) {
  bool all = true;
  for (const ipc::CanFrame& frame : frames) {
    const can_frame out = to_kernel(frame);
    if (write(fd_, &out, sizeof out) == static_cast<ssize_t>(sizeof out)) {
      ++counts_.sent;
    } else {
      ++counts_.not_sent;
      counts_.last_errno = errno;
      all = false;
    }
  }
  return all;
}

bool SocketCan::receive(ipc::CanFrame* frame) {
  can_frame in{};
  while (read(fd_, &in, sizeof in) == static_cast<ssize_t>(sizeof in)) {
    if ((in.can_id & (CAN_ERR_FLAG | CAN_RTR_FLAG | CAN_EFF_FLAG)) != 0 || in.len > CAN_MAX_DLEN) continue;
    frame->id = in.can_id & CAN_SFF_MASK;
    frame->size = in.len;
    frame->data.fill(0);
    std::copy_n(in.data, in.len, frame->data.begin());
    return true;
  }
  return false;
}

}  // namespace farpoint::drivers
