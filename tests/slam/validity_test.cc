// SPDX-License-Identifier: Apache-2.0
#include "slam/validity.h"

#include <gtest/gtest.h>

namespace farpoint::slam {
namespace {

constexpr std::int64_t kFrame_us = 50'000;

class ValidityTest : public testing::Test {
 protected:
  // A frame whose landmarks of known depth agree to this share. Returns whether its pose is valid.
  bool frame(double share, double repeated_share = 0.0) {
    outcome.confirmed_matches = 100;
    outcome.confirmed_inliers = static_cast<int>(100.0 * share);
    return step(repeated_share);
  }
  bool step(double repeated_share = 0.0) {
    return validity.note_tracked(utime += kFrame_us, judgement, outcome, repeated_share);
  }
  // Frames until validity is `wanted`, seconds; at most 10.
  double until(bool wanted, double share) {
    for (int i = 1; i <= 200; ++i)
      if (frame(share) == wanted) return 1e-6 * static_cast<double>(i * kFrame_us);
    return 10.0;
  }
  [[nodiscard]] Reason reason() const { return validity.refusal().reason; }

  Validity validity;
  MapJudgement judgement{.steady = true};
  TrackOutcome outcome;
  std::int64_t utime = 0;
};

TEST_F(ValidityTest, APoseThatItsLandmarksAgreeOnIsValid) {
  EXPECT_TRUE(frame(0.9));
  EXPECT_EQ(reason(), Reason::kNone);
}

TEST_F(ValidityTest, ADisagreementOfAFewFramesIsNone) {
  EXPECT_TRUE(frame(0.9));
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(frame(0.3)) << i;
  EXPECT_TRUE(frame(0.9));
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(frame(0.3)) << i;
}

TEST_F(ValidityTest, ALastingDisagreementIsInvalidWithinHalfASecondAndSaysTheShare) {
  EXPECT_TRUE(frame(0.9));
  EXPECT_LE(until(false, 0.3), 0.5);
  EXPECT_EQ(reason(), Reason::kDisagreement);
  EXPECT_NEAR(validity.refusal().value, 0.3, 1e-9);
}

// A share that wavers around one limit does not make validity flicker.
TEST_F(ValidityTest, BetweenItsTwoLimitsNothingChanges) {
  EXPECT_TRUE(frame(0.9));
  EXPECT_EQ(until(false, 0.6), 10.0);
  (void)until(false, 0.3);
  EXPECT_EQ(until(true, 0.6), 10.0);
  EXPECT_LE(until(true, 0.7), 0.7);
}

TEST_F(ValidityTest, LandmarksOfOpenDepthDoNotHoldAPose) {
  outcome.inliers = outcome.matches = 300;
  outcome.confirmed_matches = outcome.confirmed_inliers = 3;
  for (int i = 0; i < 10; ++i) (void)step();
  EXPECT_EQ(reason(), Reason::kFewLandmarks);
  EXPECT_EQ(validity.refusal().value, 3.0);
}

TEST_F(ValidityTest, APartOfTheImageThatRepeatsIsFrozen) {
  for (int i = 0; i < 10; ++i) (void)frame(0.9, 0.4);
  EXPECT_FALSE(frame(0.9, 0.4));
  EXPECT_EQ(reason(), Reason::kFrozenImage);
}

TEST_F(ValidityTest, AMapThatIsNotSettledSaysWhy) {
  judgement = {.scale_change = 1.1};
  EXPECT_FALSE(frame(0.9));
  EXPECT_EQ(reason(), Reason::kUnitUnsteady);
  EXPECT_NEAR(validity.refusal().value, 0.095, 0.001);
  judgement = {.steady = true, .sound = false, .unsound = {Reason::kField, 0.4, 0.2}};
  EXPECT_FALSE(frame(0.9));
  EXPECT_EQ(reason(), Reason::kField);
  judgement = {.steady = true, .sound_s = 0.2, .adjusted_utime = utime};
  EXPECT_FALSE(frame(0.9));
  EXPECT_EQ(reason(), Reason::kSoundAgain);
  judgement = {.steady = true, .calibration_contradicted = true};
  EXPECT_FALSE(frame(0.9));
  EXPECT_EQ(reason(), Reason::kCalibrationContradicted);
}

TEST_F(ValidityTest, ANewMapStartsWithoutDoubt) {
  (void)frame(0.9);
  (void)until(false, 0.3);
  validity.begin_map();
  EXPECT_TRUE(frame(0.9));
}

}  // namespace
}  // namespace farpoint::slam
