// A raw SocketCAN socket that never blocks. It survives its interface: an absent, downed or removed one is
// searched again by maintain(). One thread makes all calls.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "ipc/can_frame.h"

namespace farpoint::drivers {

enum class CanState : std::uint8_t {
  kUnknown = 0,  // nothing was sent or received yet
  kActive = 1,
  kWarning = 2,  // error counters above the warning limit
  kPassive = 3,  // error-passive
  kBusOff = 4,   // off the bus until restarted (restart-ms)
  kDown = 5,     // the interface is down
  kAbsent = 6,   // no such interface, or one without the required CAN FD
};
[[nodiscard]] const char* to_string(CanState state);

struct CanCounts {
  std::uint64_t sent = 0;
  std::uint64_t not_sent = 0;    // includes queue_full
  std::uint64_t queue_full = 0;  // the transmit queue had no room
  std::uint64_t received = 0;
  std::uint64_t error_frames = 0, bus_off = 0, reopened = 0;
  int last_errno = 0;
};

struct CanOptions {
  // Identifiers that receive() returns; the kernel filters all others.
  std::vector<std::uint32_t> wanted_ids;
  // An interface absent at the start: true waits for it, false makes it an error.
  bool wait_for_interface = false;
  // Sends CAN FD frames with bit rate switching, and receives them too.
  bool fd = false;
};

class SocketCan {
 public:
  // Throws std::runtime_error naming what is missing: a kernel with CAN, the privilege, or, without
  // wait_for_interface, the interface.
  explicit SocketCan(const std::string& interface, const CanOptions& options = {});
  // Uses an existing socket, for tests; it is never reopened.
  SocketCan(int fd, const CanOptions& options);
  ~SocketCan();
  SocketCan(const SocketCan&) = delete;
  SocketCan& operator=(const SocketCan&) = delete;

  // Sends all frames in order. A frame that the kernel refuses is counted and dropped, since the next epoch
  // carries newer data. Returns true if all were accepted. No allocation.
  bool send(std::span<const ipc::CanFrame> frames);
  // Returns an arrived frame and its age; false without one. Error frames update state() and counts(); remote
  // and extended frames are skipped. No allocation.
  [[nodiscard]] bool receive(ipc::CanFrame* frame, std::int64_t* age_us);
  // Searches an absent interface; call it about once a second. No allocation.
  void maintain();

  [[nodiscard]] CanState state() const { return state_; }
  [[nodiscard]] const CanCounts& counts() const { return counts_; }
  [[nodiscard]] int fd() const { return fd_; }

 private:
  [[nodiscard]] bool send_one(const ipc::CanFrame& frame);
  void note_failure(int error);
  void take_error_frame(std::uint32_t kinds, const std::uint8_t* data);
  // 0, or errno.
  [[nodiscard]] int open_and_bind();
  void close_socket();

  std::string interface_;
  CanOptions options_;
  int fd_ = -1;
  bool bound_ = false, given_ = false;
  CanState state_ = CanState::kUnknown;
  CanCounts counts_;
};

}  // namespace farpoint::drivers
