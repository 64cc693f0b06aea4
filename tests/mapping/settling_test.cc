// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/settling.h"

#include <gtest/gtest.h>

namespace farpoint::slam {
namespace {

constexpr double kSteady = 1.01, kMoved = 1.05;
constexpr std::int64_t kInterval_us = 200'000;
const Soundness kSound{.mean_chi2 = 0.8, .excess = 1.1};
const Soundness kUnsound{.mean_chi2 = 2.5, .field_px = 0.4};

class SettlingTest : public testing::Test {
 protected:
  SettlingTest() { settling.start_map(); }

  void note(int times, const Soundness& soundness = kSound, double scale_change = kSteady,
            bool contradicted = false) {
    for (int i = 0; i < times; ++i)
      settling.note_adjustment(soundness, scale_change, contradicted, utime += kInterval_us);
  }
  void settle() {
    note(Settling::kSteadyRun);
    ASSERT_TRUE(settled());
  }
  [[nodiscard]] bool settled(double later_s = 0.0) const {
    return settling.judgement().settled(utime + static_cast<std::int64_t>(1e6 * later_s));
  }

  Settling settling;
  std::int64_t utime = 0;
};

TEST_F(SettlingTest, SettlesAfterThreeSteadyAdjustmentsInARow) {
  note(Settling::kSteadyRun - 1);
  EXPECT_FALSE(settled());
  note(1);
  EXPECT_TRUE(settled());
}

TEST_F(SettlingTest, TheMetreOfAnotherSensorIsNotTheCameras) {
  EXPECT_EQ(settling.judgement().metre(), MetreSource::kNone);
  settling.note_motion({.unit_sigma = 0.01, .metres_per_unit = 2.0});
  EXPECT_EQ(settling.judgement().metre(), MetreSource::kWheels);
  settling.start_map();
  settling.start_metric_map();
  EXPECT_EQ(settling.judgement().metre(), MetreSource::kCameras);
}

TEST_F(SettlingTest, MovedUnitStartsTheRunAgain) {
  for (const double moved : {kMoved, 1.0 / kMoved}) {
    settling.start_map();
    note(Settling::kSteadyRun - 1);
    note(1, kSound, moved);
    EXPECT_NEAR(settling.judgement().scale_change, moved, 1e-12);
    note(Settling::kSteadyRun - 1);
    EXPECT_FALSE(settled());
    note(1);
    EXPECT_TRUE(settled());
  }
}

TEST_F(SettlingTest, MovedUnitDoesNotUnsettle) {
  settle();
  note(1, kSound, kMoved);
  EXPECT_TRUE(settled());
}

TEST_F(SettlingTest, AnUnsoundAdjustmentUnsettlesAtOnceAndForATime) {
  settle();
  note(1, kUnsound);
  EXPECT_FALSE(settled());
  EXPECT_FALSE(settled(100.0)) << "nothing says that it is sound again";
  EXPECT_EQ(settling.judgement().unsound.reason, Reason::kField);
  // The first sound adjustment begins the time, those after add theirs.
  note(8);
  EXPECT_FALSE(settled());
  note(1);
  EXPECT_TRUE(settled());
}

// Keyframes come as fast as the camera moves: seconds count, not keyframes.
TEST_F(SettlingTest, AVehicleThatStopsAfterASoundAdjustmentIsSettledAgain) {
  settle();
  note(1, kUnsound);
  note(1);
  EXPECT_FALSE(settled(1.4));
  EXPECT_TRUE(settled(1.5));
}

TEST_F(SettlingTest, ContradictedCalibrationUnsettles) {
  settle();
  note(1, kSound, kSteady, true);
  EXPECT_FALSE(settled(10.0));
  EXPECT_TRUE(settling.judgement().calibration_contradicted);
}

TEST_F(SettlingTest, NewMapIsUnsettledAndWhatBentTheLastOneIsRemembered) {
  settle();
  settling.start_map();
  EXPECT_FALSE(settled());
  EXPECT_EQ(settling.soundness().mean_chi2, 0.0);
  settle();
  note(1, kUnsound);
  settling.start_map();
  note(Settling::kSteadyRun);
  EXPECT_FALSE(settled());
  EXPECT_TRUE(settled(1.5));
}

TEST_F(SettlingTest, AGapBetweenAdjustmentsVouchesForHalfASecondAtMost) {
  settle();
  note(1, kUnsound);
  note(1);
  utime += 60'000'000;
  note(1);
  EXPECT_FALSE(settled());
  EXPECT_TRUE(settled(1.0));
}

TEST_F(SettlingTest, AdjustmentWithoutScaleChangeOnlyNotesItsSoundness) {
  settle();
  settling.note_adjustment(kUnsound, std::nullopt, false, utime);
  EXPECT_TRUE(settled());
  EXPECT_EQ(settling.soundness().mean_chi2, kUnsound.mean_chi2);
  EXPECT_FALSE(settling.fits_well());
}

TEST_F(SettlingTest, SettledMapMayWaver) {
  const Soundness between{.field_px = 0.18};  // above the limit of a new map, below that of a settled one
  note(20, between);
  EXPECT_FALSE(settled(10.0));
  settling = {};
  settling.start_map();
  settle();
  note(1, between);
  EXPECT_TRUE(settled());
}

}  // namespace
}  // namespace farpoint::slam
