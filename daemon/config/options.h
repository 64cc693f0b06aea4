// The command line of farpointd, as DESIGN.md promises it.
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace farpoint::daemon {

// What the daemon was asked to do. Empty paths mean "not wanted".
struct Options {
  std::optional<std::string> config_path;
  std::string replay;  // "-" is standard input; empty: live
  // Threads, at so many times the recorded pace; else one thread.
  std::optional<double> speed;
  // Repeat a threaded run: its schedule is in this log. Empty: no.
  std::string schedule_log;
  std::string output, trajectory, live_trajectory, can_log;
  std::string record;  // live: what the camera gave
  // Engaged but empty: wanted, with lcm.url or can.interface of the configuration.
  std::optional<std::string> lcm_url, can_interface;
  std::vector<std::string> settings;  // "dotted.key=value", in order
};

// Wrong use: what() is one line with what, where and what was expected. Exit status 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Outcome of reading the command line: either options, or text to print (--help, --version) and leave with
// status 0.
struct CommandLine {
  Options options;
  std::string text_and_leave;
};

// Throws UsageError.
[[nodiscard]] CommandLine parse_command_line(int argc, const char* const* argv);

}  // namespace farpoint::daemon
