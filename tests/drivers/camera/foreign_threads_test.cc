// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/foreign_threads.h"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>

#include <cstddef>
#include <thread>

namespace farpoint::drivers {
namespace {

struct Seen {
  int policy = -1, priority = -1;
  std::size_t stack_bytes = 0;
};

Seen seen_by_own_thread() {
  Seen seen;
  std::thread([&seen] {
    sched_param parameters{};
    pthread_getschedparam(pthread_self(), &seen.policy, &parameters);
    seen.priority = parameters.sched_priority;
    pthread_attr_t attributes;
    pthread_getattr_np(pthread_self(), &attributes);
    pthread_attr_getstacksize(&attributes, &seen.stack_bytes);
    pthread_attr_destroy(&attributes);
  }).join();
  return seen;
}

// Leaves the process as it was.
class ForeignThreads : public testing::Test {
 protected:
  void SetUp() override { pthread_getattr_default_np(&before_); }
  void TearDown() override {
    pthread_setattr_default_np(&before_);
    pthread_attr_destroy(&before_);
  }

 private:
  pthread_attr_t before_;
};

TEST_F(ForeignThreads, OfAnOrdinaryThreadAreOrdinaryWithSmallStacks) {
  limit_foreign_threads();
  const Seen seen = seen_by_own_thread();
  EXPECT_EQ(seen.policy, SCHED_OTHER);
  EXPECT_EQ(seen.stack_bytes, std::size_t{1} << 20);
}

TEST_F(ForeignThreads, OfARealTimeThreadStandOneBelowIt) {
  bool permitted = false;
  Seen seen;
  std::thread([&] {
    const sched_param wanted{10};
    permitted = pthread_setschedparam(pthread_self(), SCHED_FIFO, &wanted) == 0;
    if (!permitted) return;
    limit_foreign_threads();
    seen = seen_by_own_thread();
  }).join();
  if (!permitted) GTEST_SKIP() << "no permission for real-time priority";
  EXPECT_EQ(seen.policy, SCHED_FIFO);
  EXPECT_EQ(seen.priority, 9);
}

}  // namespace
}  // namespace farpoint::drivers
