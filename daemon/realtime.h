// What a threaded run asks of the system: locked memory, threads with a name and a stack of known size.
#pragma once

#include <pthread.h>

#include <functional>
#include <stdexcept>
#include <string>

#include "daemon/config.h"

namespace farpoint::daemon {

// Locks present and future memory, where the configuration wants it. Where the system refuses it says so,
// or, with realtime.require, throws std::runtime_error. Call before the threads start.
void lock_memory(const RealtimeConfig& config);

// A thread that runs one function to its end. The function must not throw.
class Thread {
 public:
  // `name`: at most 15 characters, as ps and top show it. priority 0: ordinary scheduling, else SCHED_FIFO;
  // a refusal is said, or thrown with realtime.require. Throws std::runtime_error where no thread can be had.
  Thread(const char* name, const RealtimeConfig& config, int priority, std::function<void()> body);
  // Waits for its end.
  ~Thread();
  Thread(const Thread&) = delete;
  Thread& operator=(const Thread&) = delete;

  void join();
  // CPU time that it has used so far, seconds; by any thread, while it has not been joined.
  [[nodiscard]] double cpu_s() const;

 private:
  static void* enter(void* self);

  std::function<void()> body_;
  pthread_t handle_{};
  clockid_t clock_{};
  bool joined_ = false;
};

}  // namespace farpoint::daemon
