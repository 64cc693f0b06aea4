// SPDX-License-Identifier: Apache-2.0
// Images of one live camera that were refused or whose time is doubtful: counted by the capture thread, put
// into words by the thread that logs.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

#include "drivers/camera/camera.h"

namespace farpoint::daemon {

class CameraTroubles {
 public:
  // Capture thread, after each of its turns.
  void note(const drivers::CameraCounts& counts) {
    times_unknown_.store(counts.times_unknown, std::memory_order_relaxed);
    times_backwards_.store(counts.times_backwards, std::memory_order_relaxed);
    undecodable_.store(counts.undecodable, std::memory_order_relaxed);
    flagged_.store(counts.flagged, std::memory_order_relaxed);
  }
  // One other thread: returns one line with the numbers since the last line; empty while nothing is new, and
  // within kQuiet_s of the last line. now_s: steady clock.
  [[nodiscard]] std::string take_line(double now_s);

 private:
  static constexpr double kQuiet_s = 10.0;
  struct Numbers {
    std::int64_t times_unknown = 0, times_backwards = 0, undecodable = 0, flagged = 0;
    [[nodiscard]] bool operator==(const Numbers&) const = default;
  };
  std::atomic<std::int64_t> times_unknown_{0}, times_backwards_{0}, undecodable_{0}, flagged_{0};
  Numbers said_;
  double next_line_s_ = 0.0;
};

}  // namespace farpoint::daemon
