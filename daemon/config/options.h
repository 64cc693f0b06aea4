// SPDX-License-Identifier: Apache-2.0
// The command line of farpointd.
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace farpoint::daemon {

// Options of one run. An empty path turns its output off.
struct Options {
  std::optional<std::string> config_path;
  std::string replay;  // "-" is standard input; empty: live
  // Threads at N times the recorded pace; empty: one thread.
  std::optional<double> speed;
  // Log with the schedule of the threaded run to repeat. Empty: none.
  std::string schedule_log;
  std::string output, trajectory, live_trajectory, can_log;
  std::string record;  // live: log of the camera's images
  // Present and empty: lcm.url or can.interface of the configuration.
  std::optional<std::string> lcm_url, can_interface;
  std::vector<std::string> settings;  // "dotted.key=value", in order
  bool check = false;                 // look whether the run would work, and leave
  bool json = false;                  // with check
};

// Wrong use: what() is one line with what, where and what was expected. Exit status 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Result of parsing: options, or text to print (--help, --version) before leaving with status 0.
struct CommandLine {
  Options options;
  std::string text_and_leave;
};

// Throws UsageError.
[[nodiscard]] CommandLine parse_command_line(int argc, const char* const* argv);

}  // namespace farpoint::daemon
