// What a threaded run asks of the system: locked memory, an awake processor, threads with a name, a stack of
// known size, a core and a priority. What is refused is said, in one place, and the run goes on without; with
// realtime.require it does not start.
#pragma once

#include <pthread.h>

#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/config/config.h"

namespace farpoint::daemon {

// Asks for what concerns the whole process, and collects what was granted and what refused.
class RealtimeReport {
 public:
  explicit RealtimeReport(const RealtimeConfig& config) : config_(config) {}
  ~RealtimeReport();
  RealtimeReport(const RealtimeReport&) = delete;
  RealtimeReport& operator=(const RealtimeReport&) = delete;

  // Locks present and future memory, where the configuration wants it. Call before the threads start.
  void lock_memory();
  // Keeps the processors from sleeping deeply, for as long as this object lives.
  void hold_cpu_latency();
  // Whether the cores' frequency is left to fall: refused by the machine's own settings, so to speak.
  // `root` stands before /sys; tests have their own.
  void check_governors(const std::string& root = "");

  void grant(const std::string& what) { granted_.push_back(what); }
  // Throws std::runtime_error with realtime.require.
  void refuse(const std::string& what);
  // One line for all that was granted, and one for each refusal.
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
  // `name`: at most 15 characters, as ps and top show it. `report` may be null. Throws std::runtime_error
  // where no thread can be had.
  Thread(const char* name, const RealtimeConfig& config, const ThreadConfig& wanted, RealtimeReport* report,
         std::function<void()> body);
  // Waits for its end.
  ~Thread();
  Thread(const Thread&) = delete;
  Thread& operator=(const Thread&) = delete;

  void join();
  // CPU time that it has used so far, seconds; by any thread, while it has not been joined.
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
