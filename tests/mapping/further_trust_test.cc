// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/further_trust.h"

#include <gtest/gtest.h>

#include <cmath>

namespace farpoint::slam {
namespace {

constexpr double kSigma_px = 0.25, kMeasurements = 200.0;

Soundness with_field(double field_px, double factor) {
  Soundness s;
  s.further_field_px = field_px;
  s.further_measurements = kMeasurements;
  s.further_sigma_px = factor * kSigma_px;
  return s;
}

TEST(FurtherTrust, ASoundRigCountsInFull) {
  FurtherTrust trust;
  for (int i = 1; i < 20; ++i) trust.note_adjustment(with_field(0.09, 1.0), i * 100'000);
  EXPECT_EQ(trust.sigma_factor(), 1.0);
}

// All measurements of a keyframe together then know the pose no better than the field is large.
TEST(FurtherTrust, AFieldCountsAsOneMeasurementOfItsSize) {
  FurtherTrust trust;
  constexpr double kField_px = 1.0, kOfSoundRigs_px = 0.1;
  trust.note_adjustment(with_field(kField_px, 1.0), 100'000);
  const double together_px = trust.sigma_factor() * kSigma_px / std::sqrt(kMeasurements);
  EXPECT_NEAR(together_px, std::sqrt(kField_px * kField_px - kOfSoundRigs_px * kOfSoundRigs_px), 0.01);
}

TEST(FurtherTrust, TheFactorDoesNotFeedItself) {
  FurtherTrust trust;
  trust.note_adjustment(with_field(0.5, 1.0), 100'000);
  const double once = trust.sigma_factor();
  trust.note_adjustment(with_field(0.5, once), 200'000);
  EXPECT_NEAR(trust.sigma_factor(), once, 1e-9);
}

TEST(FurtherTrust, AFieldIsForgottenInSeconds) {
  FurtherTrust trust;
  trust.note_adjustment(with_field(0.5, 1.0), 100'000);
  const double at_once = trust.sigma_factor();
  std::int64_t utime = 100'000;
  for (int i = 0; i < 20; ++i) trust.note_adjustment(with_field(0.0, trust.sigma_factor()), utime += 100'000);
  EXPECT_LT(trust.sigma_factor(), 0.7 * at_once);
  for (int i = 0; i < 200; ++i)
    trust.note_adjustment(with_field(0.0, trust.sigma_factor()), utime += 100'000);
  EXPECT_NEAR(trust.sigma_factor(), 1.0, 0.01);
}

TEST(FurtherTrust, ANewMapStartsWithTrust) {
  FurtherTrust trust;
  trust.note_adjustment(with_field(2.0, 1.0), 100'000);
  trust.start_map();
  EXPECT_EQ(trust.sigma_factor(), 1.0);
}

}  // namespace
}  // namespace farpoint::slam
