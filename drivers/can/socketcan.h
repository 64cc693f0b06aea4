// SPDX-License-Identifier: Apache-2.0
// A raw SocketCAN socket that never blocks. It survives its interface: an absent, downed or removed one is
// searched again by maintain(). One thread makes all calls.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "ipc/can_frame.h"

struct canfd_frame;

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
  std::uint64_t confirmed = 0;   // sent, and on the bus by the controller's word
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
  // Frames sent are counted as in flight until the controller confirms them (CAN_RAW_RECV_OWN_MSGS); see
  // take_confirmed(). The identifiers below are those that are sent.
  bool confirm = false;
  std::vector<std::uint32_t> sent_ids;
  bool extended_ids = false;  // sent_ids have 29 bits
};

class SocketCan {
 public:
  // Throws std::runtime_error naming what is missing: a kernel with CAN, the privilege, or, without
  // wait_for_interface, the interface and its CAN FD.
  explicit SocketCan(const std::string& interface, const CanOptions& options = {});
  // Uses an existing socket, for tests; it is never reopened. With options.confirm every frame that is read
  // counts as a confirmation, since such a socket cannot mark one.
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

  // With options.confirm. Returns the next own frame that the controller has put on the bus, and its age;
  // false without one. Takes error frames as receive() does. No allocation.
  [[nodiscard]] bool take_confirmed(ipc::CanFrame* frame, std::int64_t* age_us);
  // Frames that the kernel took and the controller has not confirmed. 0 after the interface went down or the
  // controller restarted, since both empty the queue; always 0 without options.confirm.
  [[nodiscard]] int in_flight() const { return in_flight_; }
  // False where the kernel gives no confirmations: frames then count as confirmed when the kernel takes them.
  [[nodiscard]] bool confirms() const { return confirms_; }
  // The reason why the interface is not in use; empty without one.
  [[nodiscard]] const char* waits_for() const { return waits_for_; }
  // Searches an absent interface; call it about once a second. No allocation.
  void maintain();

  [[nodiscard]] CanState state() const { return state_; }
  [[nodiscard]] const CanCounts& counts() const { return counts_; }
  [[nodiscard]] int fd() const { return fd_; }

 private:
  [[nodiscard]] bool send_one(const ipc::CanFrame& frame);
  [[nodiscard]] bool read_frame(canfd_frame* frame, std::int64_t* age_us, bool* own);
  void note_failure(int error);
  void note_link(int error);
  void take_error_frame(std::uint32_t kinds, const std::uint8_t* data);
  // 0, or errno.
  [[nodiscard]] int open_and_bind();
  void close_socket();

  std::string interface_;
  CanOptions options_;
  int fd_ = -1;
  bool bound_ = false, given_ = false, confirms_ = false;
  int in_flight_ = 0;
  std::uint32_t overflows_ = 0;  // of the receive queue, by the kernel's count
  const char* waits_for_ = "";
  CanState state_ = CanState::kUnknown;
  CanCounts counts_;
};

}  // namespace farpoint::drivers
