// SPDX-License-Identifier: Apache-2.0
#include "drivers/can/socketcan.h"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <stdexcept>

namespace farpoint::drivers {
namespace {

constexpr std::size_t kMaxFilters = 32;

canid_t id_mask(std::uint32_t id) {
  return (id & CAN_EFF_FLAG) != 0 ? CAN_EFF_MASK : CAN_SFF_MASK;
}

// Without a kernel that has CAN, socket() fails with one of these.
bool is_no_can(int error) {
  return error == EAFNOSUPPORT || error == EPROTONOSUPPORT || error == EINVAL;
}

bool is_absent(int error) {
  return error == ENODEV || error == ENXIO || error == EBADF || error == ENOTCONN;
}

[[noreturn]] void fail(const std::string& interface, const std::string& why) {
  throw std::runtime_error("cannot use CAN interface " + interface + ": " + why);
}

// What the kernel is to hand on: the wanted identifiers, our own where confirmed, and the controller's news.
void set_filters(int fd, const CanOptions& options) {
  std::array<can_filter, kMaxFilters> filters{};
  std::size_t count = 0;
  const auto add = [&](std::uint32_t id) {
    if (count < filters.size()) filters[count++] = {id, id_mask(id) | CAN_EFF_FLAG | CAN_RTR_FLAG};
  };
  for (const std::uint32_t id : options.wanted_ids) add(id & CAN_SFF_MASK);
  if (options.confirm) {
    for (const std::uint32_t id : options.sent_ids) add(options.extended_ids ? id | CAN_EFF_FLAG : id);
  }
  (void)setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(),
                   static_cast<socklen_t>(count * sizeof(can_filter)));
  const can_err_mask_t errors =
      CAN_ERR_CRTL | CAN_ERR_BUSOFF | CAN_ERR_RESTARTED | CAN_ERR_ACK | CAN_ERR_BUSERROR;
  (void)setsockopt(fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors);
}

// False where this kernel or socket gives none.
bool ask_for_confirmations(int fd) {
  const int on = 1;
  (void)setsockopt(fd, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on);
  return setsockopt(fd, SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, &on, sizeof on) == 0;
}

// The kernel notes when a frame arrived, by CLOCK_REALTIME.
void ask_for_times(int fd) {
  const int on = 1;
  (void)setsockopt(fd, SOL_SOCKET, SO_TIMESTAMP, &on, sizeof on);
}

std::int64_t realtime_us() {
  timespec t{};
  clock_gettime(CLOCK_REALTIME, &t);
  return std::int64_t{t.tv_sec} * 1'000'000 + t.tv_nsec / 1000;
}

// 0 where the system's time was set since it arrived.
std::int64_t age_us_of(const cmsghdr* control) {
  constexpr std::int64_t kOldest_us = 1'000'000;
  timeval arrived{};
  std::memcpy(&arrived, CMSG_DATA(control), sizeof arrived);
  const std::int64_t age_us = realtime_us() - std::int64_t{arrived.tv_sec} * 1'000'000 - arrived.tv_usec;
  return age_us < 0 || age_us > kOldest_us ? 0 : age_us;
}

struct Arrival {
  std::int64_t age_us = 0;
  std::uint32_t overflows = 0;  // of the receive queue so far
  bool own = false;             // sent by this socket, and now on the bus
};

// A classic frame is the beginning of a CAN FD frame: identifier, length, flags, data. 0, or errno; EAGAIN
// where there is no frame.
int take(int fd, canfd_frame* frame, Arrival* arrival) {
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(timeval)) + CMSG_SPACE(sizeof(std::uint32_t))>
      control{};
  iovec data{frame, sizeof *frame};
  msghdr message{};
  message.msg_iov = &data;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t got = recvmsg(fd, &message, 0);
  if (got < 0) return errno;
  if (got != CAN_MTU && got != CANFD_MTU) return EAGAIN;
  arrival->own = (message.msg_flags & MSG_CONFIRM) != 0;
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET) continue;
    if (c->cmsg_type == SCM_TIMESTAMP) arrival->age_us = age_us_of(c);
    if (c->cmsg_type == SO_RXQ_OVFL)
      std::memcpy(&arrival->overflows, CMSG_DATA(c), sizeof arrival->overflows);
  }
  return 0;
}

canfd_frame to_kernel(const ipc::CanFrame& frame, bool fd) {
  canfd_frame out{};
  out.can_id = frame.extended ? (frame.id & CAN_EFF_MASK) | CAN_EFF_FLAG : frame.id & CAN_SFF_MASK;
  out.len = std::min<std::uint8_t>(frame.size, fd ? CANFD_MAX_DLEN : CAN_MAX_DLEN);
  if (fd) out.flags = CANFD_BRS;
  std::copy_n(frame.data.begin(), out.len, out.data);
  return out;
}

ipc::CanFrame from_kernel(const canfd_frame& in) {
  ipc::CanFrame frame;
  frame.extended = (in.can_id & CAN_EFF_FLAG) != 0;
  frame.id = in.can_id & (frame.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  frame.size = in.len;
  std::copy_n(in.data, in.len, frame.data.begin());
  return frame;
}

// 0, or errno: the interface's frames must have room for CAN FD's.
int turn_on_fd(int fd, const std::string& interface) {
  const int on = 1;
  if (setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on) != 0) return errno;
  ifreq request{};
  interface.copy(request.ifr_name, sizeof request.ifr_name - 1);
  if (ioctl(fd, SIOCGIFMTU, &request) != 0) return errno;
  return request.ifr_mtu == CANFD_MTU ? 0 : EMSGSIZE;
}

}  // namespace

const char* to_string(CanState state) {
  switch (state) {
    case CanState::kUnknown:
      return "unknown";
    case CanState::kActive:
      return "active";
    case CanState::kWarning:
      return "warning";
    case CanState::kPassive:
      return "error passive";
    case CanState::kBusOff:
      return "bus off";
    case CanState::kDown:
      return "interface down";
    case CanState::kAbsent:
      return "no interface";
  }
  return "?";
}

// --- coming and going

SocketCan::SocketCan(const std::string& interface, const CanOptions& options)
    : interface_(interface), options_(options) {
  const int error = open_and_bind();
  if (error == 0) return;
  const bool kernel_has_can = fd_ >= 0 || !is_no_can(error);
  const bool absent = is_absent(error);
  close_socket();
  if (!kernel_has_can) fail(interface, "this kernel has no CAN (modules can and can_raw are needed)");
  const bool waits = absent || error == EMSGSIZE;  // CAN FD may be set up after the daemon's start
  if (waits && options.wait_for_interface) return;
  if (error == EMSGSIZE)
    fail(interface, "it has no CAN FD (can.fd; see: ip link set " + interface + " type can fd on)");
  fail(interface, absent ? "no such interface (see: ip link show type can)" : std::strerror(error));
}

SocketCan::SocketCan(int fd, const CanOptions& options)
    : options_(options), fd_(fd), bound_(true), given_(true), confirms_(options.confirm) {
  ask_for_times(fd);
}

SocketCan::~SocketCan() {
  close_socket();
}

int SocketCan::open_and_bind() {
  fd_ = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (fd_ < 0) return errno;
  set_filters(fd_, options_);
  ask_for_times(fd_);
  confirms_ = options_.confirm && ask_for_confirmations(fd_);
  waits_for_ = "there is no such interface";
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(interface_.c_str()));
  state_ = CanState::kAbsent;
  if (address.can_ifindex == 0) return ENODEV;
  waits_for_ = "it has no CAN FD (see: ip link set ... type can fd on)";
  if (const int error = options_.fd ? turn_on_fd(fd_, interface_) : 0; error != 0) return error;
  waits_for_ = "it cannot be bound";
  if (bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return errno;
  bound_ = true;
  waits_for_ = "";
  state_ = CanState::kUnknown;
  return 0;
}

void SocketCan::close_socket() {
  if (fd_ >= 0) close(fd_);
  fd_ = -1;
  bound_ = false;
  in_flight_ = 0;
  overflows_ = 0;
}

void SocketCan::maintain() {
  if (bound_ || given_) return;
  close_socket();
  if (open_and_bind() == 0) {
    ++counts_.reopened;
  } else {
    close_socket();
    state_ = CanState::kAbsent;
  }
}

void SocketCan::note_failure(int error) {
  ++counts_.not_sent;
  counts_.last_errno = error;
  // A full queue means only that no node acknowledges; error frames give the bus state.
  if (error == ENOBUFS || error == EAGAIN) ++counts_.queue_full;
  note_link(error);
}

// The kernel drops what it holds of an interface that goes down or away.
void SocketCan::note_link(int error) {
  if (error == ENETDOWN) state_ = CanState::kDown;
  if (is_absent(error)) {
    state_ = CanState::kAbsent;
    bound_ = false;
  }
  if (error == ENETDOWN || is_absent(error)) in_flight_ = 0;
}

// --- frames

bool SocketCan::send(std::span<const ipc::CanFrame> frames) {
  bool all = true;
  for (const ipc::CanFrame& frame : frames) all = send_one(frame) && all;
  return all;
}

bool SocketCan::send_one(const ipc::CanFrame& frame) {
  if (!bound_) {
    note_failure(ENODEV);
    return false;
  }
  const canfd_frame out = to_kernel(frame, options_.fd);
  const std::size_t bytes = options_.fd ? CANFD_MTU : CAN_MTU;
  if (write(fd_, &out, bytes) != static_cast<ssize_t>(bytes)) {
    note_failure(errno);
    return false;
  }
  ++counts_.sent;
  if (confirms_) ++in_flight_;
  if (state_ == CanState::kUnknown || state_ == CanState::kDown) state_ = CanState::kActive;
  return true;
}

bool SocketCan::read_frame(canfd_frame* frame, std::int64_t* age_us, bool* own) {
  while (bound_) {
    Arrival arrival;
    if (const int error = take(fd_, frame, &arrival); error != 0) {
      if (error != EAGAIN) note_link(error);
      return false;
    }
    // The confirmation may be among the lost frames, and would then never arrive.
    if (arrival.overflows != overflows_) in_flight_ = 0;
    overflows_ = arrival.overflows;
    if ((frame->can_id & CAN_ERR_FLAG) != 0) {
      take_error_frame(frame->can_id & CAN_ERR_MASK, frame->data);
      continue;
    }
    if ((frame->can_id & CAN_RTR_FLAG) != 0 || frame->len > CANFD_MAX_DLEN) continue;
    *age_us = arrival.age_us;
    *own = arrival.own || (given_ && confirms_);
    return true;
  }
  return false;
}

bool SocketCan::receive(ipc::CanFrame* frame, std::int64_t* age_us) {
  canfd_frame in{};
  bool own = false;
  while (read_frame(&in, age_us, &own)) {
    if (own || (in.can_id & CAN_EFF_FLAG) != 0) continue;
    *frame = from_kernel(in);
    ++counts_.received;
    return true;
  }
  return false;
}

bool SocketCan::take_confirmed(ipc::CanFrame* frame, std::int64_t* age_us) {
  canfd_frame in{};
  bool own = false;
  while (read_frame(&in, age_us, &own)) {
    if (!own) continue;  // another node that sends our identifier
    *frame = from_kernel(in);
    ++counts_.confirmed;
    in_flight_ = std::max(in_flight_ - 1, 0);
    return true;
  }
  return false;
}

void SocketCan::take_error_frame(std::uint32_t kinds, const std::uint8_t* data) {
  ++counts_.error_frames;
  if ((kinds & CAN_ERR_CRTL) != 0) {
    const std::uint8_t controller = data[1];
    if ((controller & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0) {
      state_ = CanState::kPassive;
    } else if ((controller & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING)) != 0) {
      state_ = CanState::kWarning;
    } else if ((controller & CAN_ERR_CRTL_ACTIVE) != 0) {
      state_ = CanState::kActive;
    }
  }
  if ((kinds & CAN_ERR_RESTARTED) != 0) {
    state_ = CanState::kActive;
    in_flight_ = 0;  // the kernel has dropped them
  }
  if ((kinds & CAN_ERR_BUSOFF) != 0) {
    state_ = CanState::kBusOff;
    ++counts_.bus_off;
  }
}

}  // namespace farpoint::drivers
