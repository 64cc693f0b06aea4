// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/notifier.h"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <climits>
#include <ctime>

namespace farpoint::daemon {

// Not std::atomic::wait(): libstdc++ yields the processor a few times before it waits, one system call each.
static_assert(sizeof(std::atomic<std::uint32_t>) == sizeof(std::uint32_t) &&
                  std::atomic<std::uint32_t>::is_always_lock_free,
              "the kernel reads the counter itself");

void Notifier::wait(std::uint32_t seen, std::int64_t timeout_us) {
  constexpr std::int64_t kMicrosPerSecond = 1'000'000, kNanosPerMicro = 1000;
  timespec limit{timeout_us / kMicrosPerSecond, timeout_us % kMicrosPerSecond * kNanosPerMicro};
  // Whatever it returns for, the caller looks anew.
  (void)syscall(SYS_futex, reinterpret_cast<std::uint32_t*>(&count_), FUTEX_WAIT_PRIVATE, seen,
                timeout_us < 0 ? nullptr : &limit, nullptr, 0);
}

void Notifier::notify() {
  count_.fetch_add(1, std::memory_order_release);
  (void)syscall(SYS_futex, reinterpret_cast<std::uint32_t*>(&count_), FUTEX_WAKE_PRIVATE, INT_MAX, nullptr,
                nullptr, 0);
}

}  // namespace farpoint::daemon
