// SPDX-License-Identifier: Apache-2.0
// The real farpointd in a process of its own, on a bus and a service manager that the test plays.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tests/ipc/dbc.h"
#include "tests/ipc/scratch.h"

namespace farpoint::test {

class LiveProgram {
 public:
  // An epoch on the bus, as the DBC decodes it.
  struct Epoch {
    double time_s = 0;  // steady clock, when it came
    double state = 0, age_s = 0, boot_counter = 0;
    bool pose_valid = false;
  };

  LiveProgram();
  ~LiveProgram();
  LiveProgram(const LiveProgram&) = delete;
  LiveProgram& operator=(const LiveProgram&) = delete;

  // Starts it with these settings (--set) and further arguments. It has no LCM, no control socket, and a
  // watchdog of 0.5 s.
  void start(const std::vector<std::string>& settings, const std::vector<std::string>& arguments = {});
  // Takes what comes from the bus and to the service manager, until `enough` or `limit_s`. Returns `enough`.
  bool run_until(const std::function<bool()>& enough, double limit_s = 60.0);
  void run_for(double duration_s);
  // Sends the signal and waits for the end. Returns the exit status, or -N for signal N.
  int stop(int signal);
  // Holds a thread of the program, which stays held until the second call.
  void hold(const std::string& thread);
  void release();

  [[nodiscard]] const std::vector<Epoch>& epochs() const { return epochs_; }
  // When the watchdog was fed, steady clock.
  [[nodiscard]] const std::vector<double>& fed_s() const { return fed_s_; }
  // Standard output and error so far.
  [[nodiscard]] std::string said() const;
  [[nodiscard]] std::string path(const std::string& name) const { return scratch_.path(name); }

 private:
  void take_bus();
  void take_notices();
  [[nodiscard]] pid_t thread_of(const std::string& name) const;

  const Scratch scratch_;
  std::map<std::uint32_t, DbcMessage> dbc_;
  int listening_ = -1, bus_ = -1, notices_ = -1;
  pid_t program_ = -1, held_ = -1;
  std::vector<Epoch> epochs_;
  std::vector<double> fed_s_;
};

}  // namespace farpoint::test
