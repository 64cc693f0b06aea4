// SIGINT and SIGTERM end a run between two frames, in order: what was worked out until then is written.
#pragma once

#include <csignal>

namespace farpoint::daemon {

class StopOnSignal {
 public:
  StopOnSignal();
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

  // The signal that came, 0 for none.
  [[nodiscard]] static int signal();
  // As if SIGTERM had come.
  static void ask();

 private:
  using Handler = void (*)(int);
  Handler on_interrupt_, on_terminate_;
};

// SIGHUP asks for the configuration to be read again.
class ReloadOnSignal {
 public:
  ReloadOnSignal();
  ~ReloadOnSignal();
  ReloadOnSignal(const ReloadOnSignal&) = delete;
  ReloadOnSignal& operator=(const ReloadOnSignal&) = delete;

  // True where one came since the last call.
  [[nodiscard]] static bool take();

 private:
  void (*on_hangup_)(int);
};

}  // namespace farpoint::daemon
