// SPDX-License-Identifier: Apache-2.0
// The daemon's log on standard error: start, end, changes of state, deviations from the configuration. No
// line for a frame.
#pragma once

#include <string>

namespace farpoint::daemon {

// Level is the key log.level: debug | info | warning | error.
void start_logging(const std::string& level);
void set_log_level(const std::string& level);

// A progress bar on standard error if that is a terminal; else silent.
class Progress {
 public:
  Progress();
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  // fraction 0..1, negative for an unknown length. Draws at most ten times a second.
  void show(double fraction, const std::string& text);
  // Clears the bar before other output.
  void clear();

 private:
  bool terminal_;
  bool drawn_ = false;
  double last_drawn_s_ = -1.0;
};

}  // namespace farpoint::daemon
