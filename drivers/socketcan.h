// A raw SocketCAN socket that never blocks.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "ipc/can_frame.h"

namespace farpoint::drivers {

struct CanCounts {
  std::uint64_t sent = 0;
  std::uint64_t not_sent = 0;  // full transmit queue, bus off, interface down or gone
  int last_errno = 0;
};

class SocketCan {
 public:
  // Throws std::runtime_error saying what is missing: a kernel with CAN, the interface, or the privilege.
  explicit SocketCan(const std::string& interface);
  ~SocketCan();
  SocketCan(const SocketCan&) = delete;
  SocketCan& operator=(const SocketCan&) = delete;

  // Sends all frames in order. A frame that the kernel does not take at once is counted and given up: the
  // next epoch carries newer data. True where all were taken. No allocation.
  bool send(std::span<const ipc::CanFrame> frames);
  // A frame that has arrived, or false where there is none. Error, remote and extended frames are passed
  // over.
  [[nodiscard]] bool receive(ipc::CanFrame* frame);

  [[nodiscard]] const CanCounts& counts() const { return counts_; }
  [[nodiscard]] int fd() const { return fd_; }

 private:
  int fd_ = -1;
  CanCounts counts_;
};

}  // namespace farpoint::drivers
