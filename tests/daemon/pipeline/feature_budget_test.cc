// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/feature_budget.h"

#include <gtest/gtest.h>

namespace farpoint::daemon {
namespace {

TEST(FeatureBudget, GivesAllWhileOnTimeAndAfterAHiccup) {
  FeatureBudget budget(1500, 0.5);
  for (int i = 0; i < 1000; ++i) {
    // As many in a row as wait after the machine was away for a moment.
    budget.note(i % 50 < 3);
    ASSERT_EQ(budget.features(), 1500) << i;
  }
}

TEST(FeatureBudget, ShrinksToItsLeastShareWhereNothingHelpsAndComesBack) {
  FeatureBudget budget(1500, 0.5);
  int before = 1500;
  for (int i = 0; i < 20; ++i) {
    budget.note(true);
    ASSERT_LE(budget.features(), before);
    ASSERT_GE(budget.features(), 750);
    before = budget.features();
  }
  EXPECT_EQ(budget.features(), 750);
  for (int i = 0; i < 200; ++i) budget.note(false);
  EXPECT_EQ(budget.features(), 1500);
}

TEST(FeatureBudget, AShareOfOneNeverShrinks) {
  FeatureBudget budget(1500, 1.0);
  for (int i = 0; i < 100; ++i) budget.note(true);
  EXPECT_EQ(budget.features(), 1500);
}

// A machine that can do 1100 features at the camera's pace must not be overloaded every second to find out.
TEST(FeatureBudget, TriesMoreEverMoreSeldomWhereMoreIsTooMuch) {
  FeatureBudget budget(1500, 0.5);
  int late_early = 0, late_later = 0;
  for (int i = 0; i < 10'000; ++i) {
    const bool late = budget.features() > 1100;
    (i < 2'000 ? late_early : late_later) += late ? 1 : 0;
    budget.note(late);
  }
  EXPECT_LE(late_early, 40);
  EXPECT_LE(late_later, 40);  // of 8,000: 0.5 %
  EXPECT_GE(late_later, 4);   // it does try
}

TEST(FeatureBudget, WhenTheLoadHasGoneItTriesSoonAgain) {
  FeatureBudget budget(1500, 0.5);
  for (int i = 0; i < 10'000; ++i) budget.note(budget.features() > 1100);
  int frames = 0;
  while (budget.features() < 1500 && frames < 10'000) budget.note(false), ++frames;
  EXPECT_LE(frames, 2'100);  // a minute at 30 Hz
  // From then on it is as patient as in the beginning.
  for (int i = 0; i < 2'000; ++i) budget.note(false);
  for (int i = 0; i < 4; ++i) budget.note(true);
  ASSERT_LT(budget.features(), 1500);
  for (int i = 0; i < 40; ++i) budget.note(false);
  EXPECT_EQ(budget.features(), 1500);
}

}  // namespace
}  // namespace farpoint::daemon
