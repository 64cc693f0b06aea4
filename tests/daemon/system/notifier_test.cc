// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/notifier.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "daemon/system/stage_clock.h"

namespace farpoint::daemon {
namespace {

TEST(Notifier, DoesNotWaitForWhatHasHappened) {
  Notifier notifier;
  const std::uint32_t seen = notifier.seen();
  notifier.notify();
  notifier.wait(seen);  // returns
  EXPECT_NE(notifier.seen(), seen);
}

TEST(Notifier, WaitsNoLongerThanItsLimit) {
  Notifier notifier;
  const double began_s = steady_s();
  notifier.wait(notifier.seen(), 2000);
  EXPECT_GE(steady_s() - began_s, 0.0015);
}

TEST(Notifier, WakesEveryoneAndLosesNothing) {
  constexpr int kRounds = 2000;
  Notifier notifier;
  std::atomic<int> given{0}, taken_a{0}, taken_b{0};
  const auto follow = [&](std::atomic<int>* taken) {
    while (taken->load() < kRounds) {
      const std::uint32_t seen = notifier.seen();
      if (given.load() > taken->load())
        ++*taken;
      else
        notifier.wait(seen);
    }
  };
  std::thread a(follow, &taken_a), b(follow, &taken_b);
  for (int i = 0; i < kRounds; ++i) {
    ++given;
    notifier.notify();
  }
  a.join();
  b.join();
  EXPECT_EQ(taken_a, kRounds);
  EXPECT_EQ(taken_b, kRounds);
}

}  // namespace
}  // namespace farpoint::daemon
