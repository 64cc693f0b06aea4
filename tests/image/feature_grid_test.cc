// SPDX-License-Identifier: Apache-2.0
#include "slam/image/feature_grid.h"

#include <gtest/gtest.h>

#include "tests/image/test_images.h"

namespace farpoint::slam {
namespace {

// The same features by looking at all of them.
std::vector<std::size_t> brute_force(const std::vector<Feature>& features, float u, float v, float radius,
                                     int low, int high) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Feature& f = features[i];
    if (f.level >= low && f.level <= high && std::abs(f.u_px - u) <= radius &&
        std::abs(f.v_px - v) <= radius) {
      found.push_back(i);
    }
  }
  return found;
}

TEST(FeatureGrid, FindsWhatLookingAtAllFinds) {
  std::mt19937_64 rng(4);
  FeatureGrid grid(640, 370, 48, 800);
  for (int round = 0; round < 5; ++round) {  // a grid is built again every frame
    std::vector<Feature> features(static_cast<std::size_t>(200 * round));
    for (Feature& f : features) {
      // Some outside: undistorted positions may be.
      f.u_px = static_cast<float>(testing::uniform(rng) * 700 - 30);
      f.v_px = static_cast<float>(testing::uniform(rng) * 430 - 30);
      f.level = static_cast<std::uint8_t>(rng() % 8);
    }
    grid.build(features);
    for (int query = 0; query < 300; ++query) {
      const auto u = static_cast<float>(testing::uniform(rng) * 760 - 60);
      const auto v = static_cast<float>(testing::uniform(rng) * 480 - 60);
      const auto radius = static_cast<float>(testing::uniform(rng) * 90);
      const int low = static_cast<int>(rng() % 8), high = low + static_cast<int>(rng() % 4);
      std::vector<std::size_t> found, again;
      grid.visit_near(features, u, v, radius, low, high, [&](std::size_t i) { found.push_back(i); });
      grid.visit_near(features, u, v, radius, low, high, [&](std::size_t i) { again.push_back(i); });
      EXPECT_EQ(found, again);
      std::sort(found.begin(), found.end());
      EXPECT_EQ(found, brute_force(features, u, v, radius, low, high));
    }
  }
}

TEST(FeatureGrid, AnEmptyOneFindsNothing) {
  const FeatureGrid grid;
  grid.visit_near({}, 5, 5, 100, 0, 7, [](std::size_t) { FAIL(); });
  FeatureGrid built(100, 100, 10, 10);
  built.build({});
  built.visit_near({}, 5, 5, 100, 0, 7, [](std::size_t) { FAIL(); });
}

}  // namespace
}  // namespace farpoint::slam
