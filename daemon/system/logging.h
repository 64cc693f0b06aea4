// The daemon's log on standard error: start, end, changes of state, what did not go as configured. Never a
// frame.
#pragma once

#include <string>

namespace farpoint::daemon {

// Level is the key log.level: debug | info | warning | error.
void start_logging(const std::string& level);
void set_log_level(const std::string& level);

// A bar on standard error where that is a terminal; silent elsewhere.
class Progress {
 public:
  Progress();
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  // fraction 0..1, negative where the length is not known. Draws at most ten times a second.
  void show(double fraction, const std::string& text);
  // Takes the bar away, so that a line can be printed.
  void clear();

 private:
  bool terminal_;
  bool drawn_ = false;
  double last_drawn_s_ = -1.0;
};

}  // namespace farpoint::daemon
