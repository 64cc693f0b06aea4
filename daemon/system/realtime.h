// SPDX-License-Identifier: Apache-2.0
// Real-time set-up of a threaded run: locked memory, processor latency, and for each thread name, stack size,
// core and priority. Refusals are reported in one place and the run continues; with realtime.require it does
// not start.
#pragma once

#include <pthread.h>

#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/config/config.h"

namespace farpoint::daemon {

// Requests what concerns the whole process, and collects grants and refusals.
class RealtimeReport {
 public:
  explicit RealtimeReport(const RealtimeConfig& config) : config_(config) {}
  ~RealtimeReport();
  RealtimeReport(const RealtimeReport&) = delete;
  RealtimeReport& operator=(const RealtimeReport&) = delete;

  // Locks present and future memory, if configured. Call before the threads start.
  void lock_memory();
  // Limits the processors' sleep states during the life of this object.
  void hold_cpu_latency();
  // Reports a frequency governor that lowers the cores' frequency as a refusal. `root` is put before /sys,
  // for tests.
  void check_governors(const std::string& root = "");

  void grant(const std::string& what) { granted_.push_back(what); }
  // Throws std::runtime_error with realtime.require.
  void refuse(const std::string& what);
  // One line for all grants, and one for each refusal.
  void print() const;

  [[nodiscard]] const std::vector<std::string>& granted() const { return granted_; }
  [[nodiscard]] const std::vector<std::string>& refused() const { return refused_; }

 private:
  RealtimeConfig config_;
  int latency_fd_ = -1;
  std::vector<std::string> granted_, refused_;
};

// A thread that runs one function to its end. The function must not throw.
class Thread {
 public:
  // `name`: at most 15 characters, as ps and top show it. `report` may be null. Throws std::runtime_error if
  // no thread can be created.
  Thread(const char* name, const RealtimeConfig& config, const ThreadConfig& wanted, RealtimeReport* report,
         std::function<void()> body);
  // Waits for its end.
  ~Thread();
  Thread(const Thread&) = delete;
  Thread& operator=(const Thread&) = delete;

  void join();
  // CPU time used so far, seconds. Any thread, before join().
  [[nodiscard]] double cpu_s() const;

 private:
  static void* enter(void* self);
  [[nodiscard]] int start(const RealtimeConfig& config, const ThreadConfig& wanted);
  void say_what_it_got(const char* name, RealtimeReport* report) const;

  std::function<void()> body_;
  pthread_t handle_{};
  clockid_t clock_{};
  bool joined_ = false;
};

}  // namespace farpoint::daemon
