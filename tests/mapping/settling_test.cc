// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/settling.h"

#include <gtest/gtest.h>

namespace farpoint::slam {
namespace {

constexpr double kSteady = 1.01, kMoved = 1.05;
const Soundness kSound{0.8, 1.0};
const Soundness kUnsound{2.5, 4.0};

void note(Settling* settling, int times, const Soundness& soundness = kSound, double scale_change = kSteady) {
  for (int i = 0; i < times; ++i) settling->note_adjustment(soundness, scale_change, false);
}

Settling settled() {
  Settling s;
  s.start_map();
  note(&s, Settling::kSteadyRun);
  EXPECT_TRUE(s.settled());
  return s;
}

TEST(Settling, SettlesAfterThreeSteadyAdjustmentsInARow) {
  Settling s;
  s.start_map();
  note(&s, Settling::kSteadyRun - 1);
  EXPECT_FALSE(s.settled());
  note(&s, 1);
  EXPECT_TRUE(s.settled());
}

TEST(Settling, MovedUnitStartsTheRunAgain) {
  for (const double moved : {kMoved, 1.0 / kMoved}) {
    Settling s;
    s.start_map();
    note(&s, Settling::kSteadyRun - 1);
    note(&s, 1, kSound, moved);
    note(&s, Settling::kSteadyRun - 1);
    EXPECT_FALSE(s.settled());
    note(&s, 1);
    EXPECT_TRUE(s.settled());
  }
}

TEST(Settling, MovedUnitDoesNotUnsettle) {
  Settling s = settled();
  note(&s, 1, kSound, kMoved);
  EXPECT_TRUE(s.settled());
}

TEST(Settling, OneUnsoundAdjustmentUnsettlesForALongRun) {
  Settling s = settled();
  note(&s, 1, kUnsound);
  EXPECT_FALSE(s.settled());
  note(&s, Settling::kSoundRun - 1);
  EXPECT_FALSE(s.settled());
  note(&s, 1);
  EXPECT_TRUE(s.settled());
}

TEST(Settling, ContradictedCalibrationUnsettles) {
  Settling s = settled();
  s.note_adjustment(kSound, kSteady, true);
  EXPECT_FALSE(s.settled());
  note(&s, Settling::kSoundRun - 1);
  EXPECT_FALSE(s.settled());
}

TEST(Settling, NewMapIsUnsettledAndKeepsTheRunOfSoundAdjustments) {
  Settling s = settled();
  s.start_map();
  EXPECT_FALSE(s.settled());
  EXPECT_EQ(s.soundness().mean_chi2, 0.0);
  note(&s, Settling::kSteadyRun);
  EXPECT_TRUE(s.settled());
  note(&s, 1, kUnsound);
  s.start_map();
  note(&s, Settling::kSoundRun - 1);
  EXPECT_FALSE(s.settled());
}

TEST(Settling, AdjustmentWithoutScaleChangeOnlyNotesItsSoundness) {
  Settling s = settled();
  s.note_adjustment(kUnsound, std::nullopt, false);
  EXPECT_TRUE(s.settled());
  EXPECT_EQ(s.soundness().mean_chi2, kUnsound.mean_chi2);
  EXPECT_FALSE(s.fits_well());
}

TEST(Settling, SettledMapMayWaver) {
  const Soundness between{1.4, 1.0};  // above the limit of a new map, below that of a settled one
  Settling fresh;
  fresh.start_map();
  note(&fresh, 2 * Settling::kSoundRun, between);
  EXPECT_FALSE(fresh.settled());
  Settling s = settled();
  note(&s, 1, between);
  EXPECT_TRUE(s.settled());
}

}  // namespace
}  // namespace farpoint::slam
