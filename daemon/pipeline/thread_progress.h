// SPDX-License-Identifier: Apache-2.0
// Whether a thread makes progress: what the watchdog is fed with.
#pragma once

#include <atomic>
#include <cstdint>

namespace farpoint::daemon {

// Steps of one thread. The thread counts them; one other thread judges it by them.
class ThreadProgress {
 public:
  // limit_s: longest time between two steps of a living thread that has work.
  explicit ThreadProgress(double limit_s) : limit_s_(limit_s) {}

  // The thread, after each piece of work and after each look for work. Makes no system call.
  void step() { steps_.fetch_add(1, std::memory_order_relaxed); }
  // The thread, after its last step. An ended thread counts as alive.
  void end() { ended_.store(true, std::memory_order_relaxed); }

  // Judging thread; call it several times within the limit. now_s: steady clock. A thread without work counts
  // as alive however long it waits; its limit begins when work is first seen.
  [[nodiscard]] bool is_alive(double now_s, bool has_work);
  [[nodiscard]] double limit_s() const { return limit_s_; }

 private:
  const double limit_s_;
  std::atomic<std::int64_t> steps_{0};
  std::atomic<bool> ended_{false};
  // The judging thread's.
  std::int64_t seen_ = -1;
  double alive_s_ = 0;
};

}  // namespace farpoint::daemon
