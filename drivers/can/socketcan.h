// A raw SocketCAN socket that never blocks, and outlives its interface: a bus that is not there, goes down or
// is unplugged is looked for again.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "ipc/can_frame.h"

struct canfd_frame;

namespace farpoint::drivers {

enum class CanState : std::uint8_t {
  kUnknown = 0,  // nothing was sent or heard yet
  kActive = 1,
  kWarning = 2,  // the controller has seen many errors
  kPassive = 3,  // it may not disturb the bus any more
  kBusOff = 4,   // it takes no part until it is started again (restart-ms)
  kDown = 5,     // the interface is down
  kAbsent = 6,   // there is no such interface, or it has no CAN FD and is to
};
[[nodiscard]] const char* to_string(CanState state);

struct CanCounts {
  std::uint64_t sent = 0;
  std::uint64_t not_sent = 0;    // of them:
  std::uint64_t queue_full = 0;  // the transmit queue had no room
  std::uint64_t confirmed = 0;   // sent, and on the bus by the controller's word
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
  // Frames sent are counted as in flight until the controller confirms them (CAN_RAW_RECV_OWN_MSGS); see
  // take_confirmed(). The identifiers below are those that are sent.
  bool confirm = false;
  std::vector<std::uint32_t> sent_ids;
  bool extended_ids = false;  // sent_ids have 29 bits
};

class SocketCan {
 public:
  // Throws std::runtime_error saying what is missing: a kernel with CAN, the privilege, and unless it is
  // waited for the interface, with CAN FD where asked.
  explicit SocketCan(const std::string& interface, const CanOptions& options = {});
  // A socket that is there already, for tests; it is not opened again. With options.confirm every frame that
  // is read counts as a confirmation, since such a socket cannot mark one.
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

  // With options.confirm. The next frame of ours that the controller has put on the bus, and how long ago, or
  // false where none is known. Takes error frames as receive() does. No allocation.
  [[nodiscard]] bool take_confirmed(ipc::CanFrame* frame, std::int64_t* age_us);
  // Frames that the kernel took and the controller has not confirmed. 0 after the interface went down or the
  // controller started anew, since both empty the queue; always 0 without options.confirm.
  [[nodiscard]] int in_flight() const { return in_flight_; }
  // False where the kernel gives no confirmations: then frames count as confirmed when the kernel took them.
  [[nodiscard]] bool confirms() const { return confirms_; }
  // What keeps the interface from being used, empty where nothing does.
  [[nodiscard]] const char* waits_for() const { return waits_for_; }
  // Where the interface is away, looks for it; call about once a second. No allocation.
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
