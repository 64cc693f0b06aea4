// SPDX-License-Identifier: Apache-2.0
#include "slam/image/corner_selection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "tests/image/test_images.h"

namespace farpoint::slam {
namespace {

// Distinct pixels; the left half of the box is `left_share` times as crowded and always stronger.
std::vector<Corner> make_corners(int count, double left_share, std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  std::set<std::pair<int, int>> used;
  std::vector<Corner> corners;
  while (static_cast<int>(corners.size()) < count) {
    const bool left = testing::uniform(rng) < left_share;
    const int x = static_cast<int>(testing::uniform(rng) * 200) + (left ? 0 : 200);
    const int y = static_cast<int>(testing::uniform(rng) * 100);
    if (!used.insert({x, y}).second) continue;
    const int score = (left ? 100 : 10) + static_cast<int>(testing::uniform(rng) * 80);
    corners.push_back(
        {static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), static_cast<std::uint16_t>(score), 0});
  }
  return corners;
}

using Pixel = std::pair<int, int>;
std::set<Pixel> pixels(const std::vector<Corner>& corners, int count) {
  std::set<Pixel> set;
  for (int i = 0; i < count; ++i)
    set.insert({corners[static_cast<std::size_t>(i)].x, corners[static_cast<std::size_t>(i)].y});
  return set;
}

constexpr PixelBox kBox{0, 0, 400, 100};

TEST(SelectSpread, GivesTheQuotaExactlyAndOnlyWhatWasThere) {
  const std::vector<Corner> corners = make_corners(900, 0.5, 1);
  const std::set<Pixel> all = pixels(corners, 900);
  for (const int quota : {0, 1, 2, 3, 7, 100, 333, 899, 900, 2000}) {
    std::vector<Corner> copy = corners;
    const int chosen = select_spread(copy, kBox, quota);
    EXPECT_EQ(chosen, std::min(quota, 900));
    const std::set<Pixel> set = pixels(copy, chosen);
    EXPECT_EQ(static_cast<int>(set.size()), chosen);  // none twice
    EXPECT_TRUE(std::includes(all.begin(), all.end(), set.begin(), set.end()));
    EXPECT_EQ(pixels(copy, 900), all);  // reordered, nothing lost
  }
}

TEST(SelectSpread, StrongRegionsDoNotTakeTheShareOfWeakOnes) {
  std::vector<Corner> corners = make_corners(2000, 0.9, 2);
  const int chosen = select_spread(corners, kBox, 120);
  ASSERT_EQ(chosen, 120);
  int right = 0;
  for (int i = 0; i < chosen; ++i) right += corners[static_cast<std::size_t>(i)].x >= 200;
  EXPECT_EQ(right, 60);
}

TEST(SelectSpread, WhatARegionCannotUseGoesToOthers) {
  std::vector<Corner> corners = make_corners(1000, 0.98, 3);
  const auto right = static_cast<int>(
      std::count_if(corners.begin(), corners.end(), [](const Corner& c) { return c.x >= 200; }));
  ASSERT_LT(right, 60);
  const int chosen = select_spread(corners, kBox, 300);
  ASSERT_EQ(chosen, 300);
  int kept_right = 0;
  for (int i = 0; i < chosen; ++i) kept_right += corners[static_cast<std::size_t>(i)].x >= 200;
  EXPECT_EQ(kept_right, right);
}

TEST(SelectSpread, ASmallRegionKeepsItsStrongest) {
  std::vector<Corner> corners = make_corners(500, 0.5, 4);
  const std::uint16_t best =
      std::max_element(corners.begin(), corners.end(), [](const Corner& a, const Corner& b) {
        return a.score < b.score;
      })->score;
  ASSERT_EQ(select_spread(corners, kBox, 1), 1);
  EXPECT_EQ(corners[0].score, best);
}

TEST(SelectSpread, TheInputsOrderDoesNotMatter) {
  std::vector<Corner> a = make_corners(700, 0.7, 5), b = a;
  std::reverse(b.begin(), b.end());
  select_spread(a, kBox, 150);
  select_spread(b, kBox, 150);
  EXPECT_EQ(pixels(a, 150), pixels(b, 150));
}

TEST(ShareQuota, FollowsTheWeightsAndPassesOnWhatIsNotUsed) {
  const std::vector<double> weights = {4, 2, 1, 1};
  std::vector<int> quota(4);
  share_quota(800, weights, std::vector<int>{1000, 1000, 1000, 1000}, quota);
  EXPECT_EQ(quota, (std::vector<int>{400, 200, 100, 100}));
  share_quota(800, weights, std::vector<int>{100, 1000, 1000, 1000},
              quota);  // 300 left over for weights 2 1 1
  EXPECT_EQ(quota, (std::vector<int>{100, 350, 175, 175}));
  share_quota(800, weights, std::vector<int>{100, 50, 0, 30}, quota);
  EXPECT_EQ(quota, (std::vector<int>{100, 50, 0, 30}));
  share_quota(0, weights, std::vector<int>{5, 5, 5, 5}, quota);
  EXPECT_EQ(quota, (std::vector<int>{0, 0, 0, 0}));
}

TEST(ShareQuota, AddsUpToTheTotalAndNeverPassesALimit) {
  std::mt19937_64 rng(6);
  for (int trial = 0; trial < 2000; ++trial) {
    const std::size_t n = 1 + rng() % 9;
    std::vector<double> weights;
    std::vector<int> available, quota(n);
    int sum_available = 0;
    for (std::size_t i = 0; i < n; ++i) {
      weights.push_back(std::pow(1.2, -static_cast<double>(i)));
      available.push_back(static_cast<int>(rng() % 400));
      sum_available += available.back();
    }
    const int total = static_cast<int>(rng() % 1500);
    share_quota(total, weights, available, quota);
    int sum = 0;
    for (std::size_t i = 0; i < n; ++i) {
      EXPECT_GE(quota[i], 0);
      EXPECT_LE(quota[i], available[i]);
      sum += quota[i];
    }
    EXPECT_EQ(sum, std::min(total, sum_available));
  }
}

}  // namespace
}  // namespace farpoint::slam
