// SPDX-License-Identifier: Apache-2.0
// Functions that a live run can do without. One that cannot begin is logged, counted, and tried again every
// second on a thread of its own (fp-retry); tracking and CAN never wait for it.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "daemon/config/config.h"
#include "daemon/system/notifier.h"
#include "daemon/system/realtime.h"

namespace farpoint::daemon {

// Each is a bit of status_t.side_missing: 1 << value.
enum class SideFunction : std::uint8_t {
  kLcm = 0,
  kOutputLog = 1,
  kLiveTrajectory = 2,
  kCanLog = 3,
  kRecording = 4,
  kLogFile = 5,
  kMavlink = 6,
};

class SideFunctions {
 public:
  static constexpr const char* kThread = "fp-retry";
  static constexpr std::int64_t kRetryEvery_us = 1'000'000;
  // Throws std::exception with the reason where the function cannot begin now.
  using Begin = std::function<void()>;

  SideFunctions() = default;
  // Calls stop().
  ~SideFunctions() { stop(); }
  SideFunctions(const SideFunctions&) = delete;
  SideFunctions& operator=(const SideFunctions&) = delete;

  // Before start(). Begins the function at once; a failure is logged and left to the thread.
  void begin(SideFunction which, const std::string& what, Begin begin);
  // Starts the thread where a function is missing. `report` may be null.
  void start(const RealtimeConfig& config, RealtimeReport* report);
  // Ends the thread; what `begin` called must outlive this call.
  void stop();
  // One attempt at each missing function; the thread's work, for tests without it.
  void retry();

  // Any thread. Bits of the functions that have not begun.
  [[nodiscard]] std::int32_t missing() const { return missing_.load(std::memory_order_relaxed); }
  // Attempts that failed.
  [[nodiscard]] std::int64_t failures() const { return failures_.load(std::memory_order_relaxed); }

 private:
  struct Missing {
    SideFunction which = SideFunction::kLcm;
    std::string what;
    Begin begin;
  };
  // Empty on success, else the reason.
  [[nodiscard]] std::string attempt(const Begin& begin);
  void run();

  std::vector<Missing> waiting_;
  std::unique_ptr<Thread> thread_;
  Notifier stopping_;
  std::atomic<bool> stop_{false};
  std::atomic<std::int32_t> missing_{0};
  std::atomic<std::int64_t> failures_{0};
};

}  // namespace farpoint::daemon
