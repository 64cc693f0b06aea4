// SPDX-License-Identifier: Apache-2.0
// A receiver on the other end of a socket that stands for the bus: it decodes by the DBC file and confirms
// frames.
#pragma once

#include <linux/can.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "drivers/can/socketcan.h"
#include "tests/ipc/dbc.h"
#include "tests/support/paths.h"

namespace farpoint::test {

class CanReceiver {
 public:
  // One epoch: the value of every signal by its name, of the frames that came.
  using Epoch = std::map<std::string, double>;

  CanReceiver() : dbc_(read_dbc(source_dir() + "/config/farpoint.dbc")) {
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0, ends_.data()) != 0) ends_ = {-1, -1};
  }
  ~CanReceiver() { close(ends_[1]); }
  CanReceiver(const CanReceiver&) = delete;
  CanReceiver& operator=(const CanReceiver&) = delete;

  // The sender's end; call once.
  std::unique_ptr<drivers::SocketCan> bus(bool confirm) {
    drivers::CanOptions options;
    options.confirm = confirm;
    confirms_ = confirm;
    return std::make_unique<drivers::SocketCan>(ends_[0], options);
  }

  // Takes what was sent; without an answer nothing is confirmed. Returns how many frames came.
  int take(bool answers = true) {
    int came = 0;
    can_frame in{};
    while (read(ends_[1], &in, sizeof in) == static_cast<ssize_t>(sizeof in)) {
      ++came;
      note(in);
      if (confirms_ && answers) confirm(in);
      if (confirms_ && !answers) held_.push_back(in);
    }
    return came;
  }
  // Confirms what was not: the bus is back.
  void come_back() {
    for (const can_frame& frame : held_) confirm(frame);
    held_.clear();
  }
  [[nodiscard]] const std::vector<Epoch>& epochs() const { return epochs_; }

 private:
  void note(const can_frame& in) {
    const DbcMessage& message = dbc_.at(in.can_id);
    if (message.name == "FARPOINT_STATUS") epochs_.emplace_back();
    if (epochs_.empty()) return;
    ipc::CanFrame frame;
    frame.id = in.can_id;
    std::copy_n(in.data, in.len, frame.data.begin());
    for (const auto& [name, signal] : message.signals) {
      if (name == "Counter" && message.name != "FARPOINT_STATUS") continue;
      epochs_.back()[name] = signal.value(frame);
    }
  }
  void confirm(const can_frame& frame) { (void)!write(ends_[1], &frame, sizeof frame); }

  std::map<std::uint32_t, DbcMessage> dbc_;
  std::array<int, 2> ends_{};
  bool confirms_ = false;
  std::vector<Epoch> epochs_;
  std::vector<can_frame> held_;
};

}  // namespace farpoint::test
