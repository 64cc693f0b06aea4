// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/thread_progress.h"

#include <gtest/gtest.h>

namespace farpoint::daemon {
namespace {

constexpr double kLimit_s = 0.5;

TEST(ThreadProgress, AThreadThatStepsIsAlive) {
  ThreadProgress progress(kLimit_s);
  for (double now_s = 100.0; now_s < 105.0; now_s += 0.1) {
    progress.step();
    EXPECT_TRUE(progress.is_alive(now_s, true)) << now_s;
  }
}

TEST(ThreadProgress, AThreadWithWorkThatFinishesNoneIsHungAfterItsLimitAndAliveWithItsNextStep) {
  ThreadProgress progress(kLimit_s);
  progress.step();
  EXPECT_TRUE(progress.is_alive(100.0, true));
  EXPECT_TRUE(progress.is_alive(100.4, true));
  EXPECT_TRUE(progress.is_alive(100.5, true));
  EXPECT_FALSE(progress.is_alive(100.6, true));
  EXPECT_FALSE(progress.is_alive(200.0, true));
  progress.step();
  EXPECT_TRUE(progress.is_alive(200.1, true));
}

TEST(ThreadProgress, AThreadWithoutWorkIsAliveAndItsLimitBeginsWithTheWork) {
  ThreadProgress progress(kLimit_s);
  progress.step();
  for (double now_s = 100.0; now_s < 110.0; now_s += 0.1)
    EXPECT_TRUE(progress.is_alive(now_s, false)) << now_s;
  EXPECT_TRUE(progress.is_alive(110.0, true));
  EXPECT_TRUE(progress.is_alive(110.3, true));
  EXPECT_FALSE(progress.is_alive(110.7, true));
}

TEST(ThreadProgress, AnEndedThreadIsAlive) {
  ThreadProgress progress(kLimit_s);
  EXPECT_TRUE(progress.is_alive(100.0, true));
  progress.end();
  EXPECT_TRUE(progress.is_alive(200.0, true));
}

// It may never have made a step.
TEST(ThreadProgress, TheLimitOfAThreadThatNeverSteppedBeginsWithTheFirstQuestion) {
  ThreadProgress progress(kLimit_s);
  EXPECT_TRUE(progress.is_alive(100.0, true));
  EXPECT_FALSE(progress.is_alive(101.0, true));
}

}  // namespace
}  // namespace farpoint::daemon
