// A raw SocketCAN socket that never blocks, and outlives its interface: a bus that is not there, goes down or
// is unplugged is looked for again.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "ipc/can_frame.h"

namespace farpoint::drivers {

enum class CanState : std::uint8_t {
  kUnknown = 0,  // nothing was sent or heard yet
  kActive = 1,
  kWarning = 2,  // the controller has seen many errors
  kPassive = 3,  // it may not disturb the bus any more
  kBusOff = 4,   // it takes no part until it is started again (restart-ms)
  kDown = 5,     // the interface is down
  kAbsent = 6,   // there is no such interface, or it cannot do CAN FD and is to
};
[[nodiscard]] const char* to_string(CanState state);

struct CanCounts {
  std::uint64_t sent = 0;
  std::uint64_t not_sent = 0;    // of them:
  std::uint64_t queue_full = 0;  // the transmit queue had no room
  std::uint64_t received = 0;
  std::uint64_t error_frames = 0, bus_off = 0, reopened = 0;
  int last_errno = 0;
};

struct CanOptions {
  // Identifiers that receive() is to give; the kernel keeps all others away.
  std::vector<std::uint32_t> wanted_ids;
  // Whether an interface that is not there yet is waited for, or an error.
  bool wait_for_interface = false;
  // Frames are sent as CAN FD's, with the faster bit rate in their data, and such frames are received too.
  bool fd = false;
};

class SocketCan {
 public:
  // Throws std::runtime_error saying what is missing: a kernel with CAN, the privilege, and unless it is
  // waited for the interface.
  explicit SocketCan(const std::string& interface, const CanOptions& options = {});
  // A socket that is there already, for tests; it is not opened again.
  SocketCan(int fd, const CanOptions& options);
  ~SocketCan();
  SocketCan(const SocketCan&) = delete;
  SocketCan& operator=(const SocketCan&) = delete;

  // Sends all frames in order. A frame that the kernel does not take at once is counted and given up: the
  // next epoch carries newer data. True where all were taken. No allocation.
  bool send(std::span<const ipc::CanFrame> frames);
  // A frame that has arrived, and how long ago, or false where there is none. Error frames go into state()
  // and counts(); remote and extended frames are passed over. No allocation.
  [[nodiscard]] bool receive(ipc::CanFrame* frame, std::int64_t* age_us);
  // Where the interface is away, looks for it; call about once a second. No allocation.
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
