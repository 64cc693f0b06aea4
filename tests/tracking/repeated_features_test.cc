// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/repeated_features.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace farpoint::slam {
namespace {

FeatureSet random_features(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  FeatureSet set;
  for (std::size_t i = 0; i < count; ++i) {
    Feature f;
    f.u_px = static_cast<float>(rng() % 640);
    f.v_px = static_cast<float>(rng() % 480);
    set.features.push_back(f);
    Descriptor d;
    for (std::uint64_t& word : d.words) word = rng();
    set.descriptors.push_back(d);
  }
  return set;
}

TEST(RepeatedFeatures, CountsThoseOfTheFrameBeforeBitForBit) {
  RepeatedFeatures repeated(1000);
  FeatureSet set = random_features(1000, 1);
  EXPECT_EQ(repeated.add(set), 0.0);
  EXPECT_EQ(repeated.add(set), 1.0);
  const FeatureSet other = random_features(1000, 2);
  std::copy_n(other.features.begin(), 250, set.features.begin());
  std::copy_n(other.descriptors.begin(), 250, set.descriptors.begin());
  EXPECT_DOUBLE_EQ(repeated.add(set), 0.75);
  EXPECT_DOUBLE_EQ(repeated.add(other), 0.25);
}

TEST(RepeatedFeatures, OneBitOrOnePlaceIsAnotherFeature) {
  RepeatedFeatures repeated(10);
  FeatureSet set = random_features(4, 3);
  (void)repeated.add(set);
  set.descriptors[0].words[3] ^= 1U;
  set.features[1].u_px += 1.0F;
  set.features[2].level = 1;
  EXPECT_DOUBLE_EQ(repeated.add(set), 0.25);
}

TEST(RepeatedFeatures, TakesFewerAndNoFeatures) {
  RepeatedFeatures repeated(10);
  EXPECT_EQ(repeated.add({}), 0.0);
  EXPECT_EQ(repeated.add(random_features(10, 4)), 0.0);
  EXPECT_EQ(repeated.add({}), 0.0);
}

}  // namespace
}  // namespace farpoint::slam
