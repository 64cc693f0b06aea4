// SPDX-License-Identifier: Apache-2.0
// SIGINT and SIGTERM end a run between two frames; results up to then are written.
#pragma once

#include <csignal>

namespace farpoint::daemon {

class StopOnSignal {
 public:
  StopOnSignal();
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

  // The received signal, 0 for none.
  [[nodiscard]] static int signal();
  // Acts like SIGTERM.
  static void ask();

 private:
  using Handler = void (*)(int);
  Handler on_interrupt_, on_terminate_;
};

// SIGHUP requests that the configuration is read again.
class ReloadOnSignal {
 public:
  ReloadOnSignal();
  ~ReloadOnSignal();
  ReloadOnSignal(const ReloadOnSignal&) = delete;
  ReloadOnSignal& operator=(const ReloadOnSignal&) = delete;

  // Returns true after a SIGHUP since the last call.
  [[nodiscard]] static bool take();

 private:
  void (*on_hangup_)(int);
};

}  // namespace farpoint::daemon
