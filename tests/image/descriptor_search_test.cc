// SPDX-License-Identifier: Apache-2.0
#include "slam/image/descriptor_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace farpoint::slam {
namespace {

TEST(SamePlace, WithinThreePixelsBothWays) {
  const auto at = [](float u, float v) {
    Feature f;
    f.u_px = u, f.v_px = v;
    return f;
  };
  EXPECT_TRUE(same_place(at(10, 10), at(12.9F, 7.1F)));
  EXPECT_FALSE(same_place(at(10, 10), at(13.1F, 10)));
  EXPECT_FALSE(same_place(at(10, 10), at(10, 13.1F)));
}

Descriptor with_bits(int n) {
  Descriptor d;
  for (int i = 0; i < n; ++i) d.words[static_cast<std::size_t>(i / 64)] |= std::uint64_t{1} << (i % 64);
  return d;
}

class FindDescriptorTest : public testing::Test {
 protected:
  // A feature whose descriptor differs from the query's by `distance` bits.
  void add(float u, float v, int distance, int level = 0) {
    Feature f;
    f.u_px = u, f.v_px = v;
    f.level = static_cast<std::uint8_t>(level);
    set.features.push_back(f);
    set.descriptors.push_back(with_bits(distance));
  }
  int find(float ratio = 0.9F) {
    grid.build(set.features);
    DescriptorQuery q;
    q.u_px = 100, q.v_px = 100, q.radius_px = 20, q.max_level = 7;
    q.ratio = ratio;
    return find_descriptor(
        set, grid, q, [this](std::size_t i) { return i != forbidden; }, &distance);
  }

  FeatureSet set;
  FeatureGrid grid{640, 480, 32, 1000};
  std::size_t forbidden = 1000;
  int distance = -1;
};

TEST_F(FindDescriptorTest, NothingThere) {
  EXPECT_EQ(find(), -1);
}

TEST_F(FindDescriptorTest, TakesTheNearestDescriptorInTheWindow) {
  add(100, 100, 40);
  add(110, 95, 20);
  add(140, 100, 5);  // out of the window
  EXPECT_EQ(find(), 1);
  EXPECT_EQ(distance, 20);
}

TEST_F(FindDescriptorTest, LevelsAndUserDecideWhoMayBeTaken) {
  add(100, 100, 10, 8);
  add(104, 100, 20, 7);
  add(110, 100, 50);
  EXPECT_EQ(find(), 1);
  forbidden = 1;
  EXPECT_EQ(find(), 2);
}

TEST_F(FindDescriptorTest, TooDifferentIsNoMatch) {
  add(100, 100, 65);
  EXPECT_EQ(find(), -1);
  add(110, 100, 64);
  EXPECT_EQ(find(1.0F), 1);
}

TEST_F(FindDescriptorTest, ARivalElsewhereMakesItAmbiguous) {
  add(100, 100, 30);
  add(110, 100, 33);
  EXPECT_EQ(find(0.9F), -1);  // 30 > 29.7
  EXPECT_EQ(find(0.95F), 0);
  EXPECT_EQ(find(1.0F), 0);
}

TEST_F(FindDescriptorTest, TheSameCornerOnAnotherLevelIsNoRival) {
  add(100, 100, 30, 0);
  add(101, 101, 31, 1);
  EXPECT_EQ(find(), 0);
  add(102, 100, 29, 2);  // better still, same place
  EXPECT_EQ(find(), 2);
  add(110, 100, 60);
  EXPECT_EQ(find(), 2);
}

TEST_F(FindDescriptorTest, ARivalOfAnOlderBestAtTheFinalPlaceIsNone) {
  // The middle one is no rival of the last, which is at its place; it was one of the first.
  add(100, 100, 20);
  add(104, 100, 21);
  add(102, 100, 19);
  EXPECT_EQ(find(), 2);
}

TEST_F(FindDescriptorTest, WhatStoodBesideAnOlderBestIsARivalOfTheFinalOne) {
  add(98, 100, 21);
  add(100, 100, 20);
  add(102, 100, 19);  // 4 px from the first
  EXPECT_EQ(find(), -1);
}

TEST_F(FindDescriptorTest, AgreesWithTwoPasses) {
  std::mt19937_64 random(9);
  const auto uniform = [&](double low, double high) {
    return static_cast<float>(std::uniform_real_distribution<double>(low, high)(random));
  };
  int found = 0, ambiguous = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    set = {};
    const std::size_t n = 1 + random() % 8;
    for (std::size_t i = 0; i < n; ++i)
      add(uniform(100, 110), uniform(98, 102), static_cast<int>(10 + random() % 30));
    // All in one cell of the grid, hence visited by index: first the best, then the best rival.
    int best = -1;
    for (std::size_t i = 0; i < n; ++i)
      if (best < 0 || set.descriptors[i].words[0] < set.descriptors[static_cast<std::size_t>(best)].words[0])
        best = static_cast<int>(i);
    const Feature& place = set.features[static_cast<std::size_t>(best)];
    const int d = hamming_distance(Descriptor{}, set.descriptors[static_cast<std::size_t>(best)]);
    int second = 257;
    for (std::size_t i = 0; i < n; ++i)
      if (!same_place(place, set.features[i]))
        second = std::min(second, hamming_distance({}, set.descriptors[i]));
    const bool clear = static_cast<float>(d) <= 0.9F * static_cast<float>(second);
    ++(clear ? found : ambiguous);
    const int answer = find();
    ASSERT_EQ(answer >= 0, clear) << trial;
    if (clear) {
      ASSERT_EQ(distance, d);
    }
  }
  EXPECT_GT(found, 2000);
  EXPECT_GT(ambiguous, 2000);
}

}  // namespace
}  // namespace farpoint::slam
