// SPDX-License-Identifier: Apache-2.0
// Wakes one thread by another without a lock: the one place where a thread waits.
#pragma once

#include <atomic>
#include <cstdint>

namespace farpoint::daemon {

// wait() makes one system call, and none after a notification since seen(). notify() makes one; another
// thread may call it in place of the one whose work is done.
//
//   const std::uint32_t seen = notifier.seen();
//   if (nothing to do) notifier.wait(seen, timeout);
class Notifier {
 public:
  static constexpr std::int64_t kNoLimit = -1;

  [[nodiscard]] std::uint32_t seen() const { return count_.load(std::memory_order_acquire); }
  // Returns after notify() since seen(), after timeout_us, or spuriously.
  void wait(std::uint32_t seen, std::int64_t timeout_us = kNoLimit);
  // Wakes all waiting threads.
  void notify();

 private:
  std::atomic<std::uint32_t> count_{0};
};

}  // namespace farpoint::daemon
