// SPDX-License-Identifier: Apache-2.0
// Bytes to and from an autopilot: a UDP socket or a serial port. Reads and writes never wait. One thread
// makes all calls after the construction.
#pragma once

#include <cerrno>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

namespace farpoint::drivers {

struct MavlinkLinkCounts {
  std::uint64_t sent = 0;      // messages that the kernel took whole
  std::uint64_t not_sent = 0;  // refused: no receiver, no room, no device
  std::uint64_t reopened = 0;
  int last_errno = 0;
};

// Where to: 'udp:ADDRESS:PORT', 'udp:ADDRESS:PORT:LOCAL_PORT' (IPv4 numbers; without LOCAL_PORT the kernel
// chooses one), or 'serial:DEVICE:BAUD'.
struct MavlinkAddress {
  bool is_serial = false;
  std::string host;  // or the device
  int port = 0;      // or the baud rate
  int local_port = 0;

  // Empty where `text` is well formed, else what was expected.
  [[nodiscard]] static std::string check(const std::string& text);
  // Precondition: check(text) is empty.
  [[nodiscard]] static MavlinkAddress parse(const std::string& text);
};

class MavlinkLink {
 public:
  // Opens nothing yet.
  explicit MavlinkLink(MavlinkAddress address) : address_(std::move(address)) {}
  ~MavlinkLink() { close(); }
  MavlinkLink(const MavlinkLink&) = delete;
  MavlinkLink& operator=(const MavlinkLink&) = delete;

  // Opens what is not open. Returns empty, or why it could not. A serial device may take a while.
  [[nodiscard]] std::string open();
  [[nodiscard]] bool is_open() const { return fd_ >= 0; }
  // For poll(); -1 while it is not open.
  [[nodiscard]] int fd() const { return fd_; }

  // One whole message. False where the kernel did not take it: counted and dropped, since the next one is
  // newer. A device that is gone is closed.
  bool send(std::span<const std::uint8_t> message);
  // What has come, at most the room there is; empty without anything.
  [[nodiscard]] std::span<const std::uint8_t> receive(std::span<std::uint8_t> room);

  // poll() has reported that the other end of a serial device is gone: closes it.
  void hang_up() { note_failure(EIO); }

  [[nodiscard]] const MavlinkLinkCounts& counts() const { return counts_; }

 private:
  void note_failure(int error);
  void close();

  MavlinkAddress address_;
  int fd_ = -1;
  bool was_open_ = false;
  MavlinkLinkCounts counts_;
};

}  // namespace farpoint::drivers
