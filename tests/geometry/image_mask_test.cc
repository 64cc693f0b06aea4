// SPDX-License-Identifier: Apache-2.0
#include "slam/geometry/image_mask.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace farpoint::slam {
namespace {

constexpr int kWidth = 37, kHeight = 23;

std::vector<std::uint8_t> speckled() {
  std::mt19937_64 random(3);
  std::vector<std::uint8_t> pixels;
  for (int i = 0; i < kWidth * kHeight; ++i) pixels.push_back(random() % 40 == 0 ? 0 : 255);
  return pixels;
}

// What touches() promises, pixel by pixel.
bool touches_one_by_one(const std::vector<std::uint8_t>& pixels, double u, double v, double radius) {
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      if (pixels[static_cast<std::size_t>(y * kWidth + x)] == 0 && x >= std::floor(u - radius) &&
          x <= std::ceil(u + radius) && y >= std::floor(v - radius) && y <= std::ceil(v + radius))
        return true;
  return false;
}

TEST(ImageMask, TouchesWhatASearchPixelByPixelFinds) {
  const std::vector<std::uint8_t> pixels = speckled();
  const ImageMask mask(kWidth, kHeight, pixels);
  int touching = 0;
  for (const double radius : {0.0, 0.4, 1.0, 3.5, 8.0})
    for (double v = -9.25; v < kHeight + 9; v += 0.75)
      for (double u = -9.25; u < kWidth + 9; u += 0.75) {
        const bool expected = touches_one_by_one(pixels, u, v, radius);
        touching += expected ? 1 : 0;
        ASSERT_EQ(mask.touches({u, v}, radius), expected) << u << ' ' << v << ' ' << radius;
      }
  EXPECT_GT(touching, 1000);
}

TEST(ImageMask, OnlyZeroIsMasked) {
  std::vector<std::uint8_t> pixels(kWidth * kHeight, 1);
  EXPECT_EQ(ImageMask(kWidth, kHeight, pixels).share(), 0.0);
  for (int x = 0; x < kWidth; ++x) pixels[static_cast<std::size_t>(x)] = 0;
  EXPECT_NEAR(ImageMask(kWidth, kHeight, pixels).share(), 1.0 / kHeight, 1e-12);
}

TEST(ImageMask, FarAwayAndImpossiblePixelsAreSafe) {
  const ImageMask mask(kWidth, kHeight, speckled());
  EXPECT_FALSE(mask.touches({1e300, -1e300}, 10));
  EXPECT_TRUE(mask.touches({0, 0}, 1e300));
  EXPECT_TRUE(mask.touches({std::numeric_limits<double>::quiet_NaN(), 5}, 1));
  EXPECT_TRUE(mask.touches({5, std::numeric_limits<double>::infinity()}, 1));
}

}  // namespace
}  // namespace farpoint::slam
