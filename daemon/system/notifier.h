// The one place where a thread may wait.
#pragma once

#include <atomic>
#include <cstdint>

namespace farpoint::daemon {

// Waiting is one system call, and none where something has happened since; telling is one, and can be left to
// a thread that may make it.
//
//   const std::uint32_t seen = notifier.seen();
//   if (nothing to do) notifier.wait(seen, timeout);
class Notifier {
 public:
  static constexpr std::int64_t kNoLimit = -1;

  [[nodiscard]] std::uint32_t seen() const { return count_.load(std::memory_order_acquire); }
  // Returns when notify() has been called since seen(), after timeout_us, or for no reason.
  void wait(std::uint32_t seen, std::int64_t timeout_us = kNoLimit);
  // Wakes everyone who waits here.
  void notify();

 private:
  std::atomic<std::uint32_t> count_{0};
};

}  // namespace farpoint::daemon
