// SPDX-License-Identifier: Apache-2.0
#include "slam/image/pyramid.h"

#include <gtest/gtest.h>

#include "tests/image/test_images.h"

namespace farpoint::slam {
namespace {

using testing::OwnedImage;

TEST(Pyramid, SizesAndScalesFollowTheFactor) {
  const Pyramid pyramid(1242, 375, {.levels = 8, .scale_factor = 1.2});
  ASSERT_EQ(pyramid.levels(), 8);
  for (int l = 0; l < 8; ++l) {
    const double scale = std::pow(1.2, l);
    EXPECT_NEAR(pyramid.scale(l), scale, 1e-6 * scale);
    EXPECT_EQ(pyramid.level(l).width_px, std::lround(1242 / scale));
    EXPECT_EQ(pyramid.level(l).height_px, std::lround(375 / scale));
  }
  EXPECT_GT(pyramid.bytes(), 1242U * 375U * 2);
}

TEST(Pyramid, LevelZeroIsACopyAndRespectsTheStride) {
  const OwnedImage big = testing::random_image(200, 120, 3);
  const ImageView part{big.pixels.data() + 17, 150, 100, 200};
  Pyramid pyramid(150, 100, {});
  pyramid.build(part);
  const ImageView level = pyramid.level(0);
  EXPECT_NE(level.data, part.data);
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 150; ++x) ASSERT_EQ(level.data[y * level.stride_bytes + x], big.at(x + 17, y));
  }
}

TEST(Pyramid, AConstantStaysConstant) {
  for (const int value : {0, 1, 100, 254, 255}) {
    const OwnedImage image(131, 97, static_cast<std::uint8_t>(value));
    Pyramid pyramid(131, 97, {});
    pyramid.build(image.view());
    for (int l = 0; l < pyramid.levels(); ++l) {
      const ImageView level = pyramid.level(l);
      for (int y = 0; y < level.height_px; ++y) {
        for (int x = 0; x < level.width_px; ++x)
          ASSERT_EQ(level.data[y * level.stride_bytes + x], value) << l;
      }
    }
  }
}

// Intensity centroid of a level, as level-0 pixels.
Eigen::Vector2d centroid_in_base_px(const Pyramid& pyramid, int l) {
  const ImageView image = pyramid.level(l);
  double sum = 0, sx = 0, sy = 0;
  for (int y = 0; y < image.height_px; ++y) {
    for (int x = 0; x < image.width_px; ++x) {
      const double v = image.data[y * image.stride_bytes + x];
      sum += v;
      sx += v * x;
      sy += v * y;
    }
  }
  const double scale = std::pow(1.2, l);
  return {(sx / sum + 0.5) * scale - 0.5, (sy / sum + 0.5) * scale - 0.5};
}

// A blob must lie at the same level-0 position in every level. Sizes are odd on purpose: a resampling that
// stretches each level to its rounded size is off by up to half a pixel at the far end.
TEST(Pyramid, LevelsAreNotShiftedAgainstEachOther) {
  std::mt19937_64 rng(5);
  double worst = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const double cx = 60 + 520 * testing::uniform(rng), cy = 60 + 250 * testing::uniform(rng);
    const OwnedImage image = testing::render(643, 371, [&](double x, double y) {
      return 240 * std::exp(-((x - cx) * (x - cx) + (y - cy) * (y - cy)) / (2 * 9.0 * 9.0));
    });
    Pyramid pyramid(643, 371, {});
    pyramid.build(image.view());
    for (int l = 0; l < pyramid.levels(); ++l) {
      const Eigen::Vector2d error = centroid_in_base_px(pyramid, l) - Eigen::Vector2d(cx, cy);
      worst = std::max(worst, error.cwiseAbs().maxCoeff());
    }
  }
  EXPECT_LT(worst, 0.05);
}

// A ramp is reproduced by a filter with an exact first moment: each level pixel holds the ramp's value at its
// centre.
TEST(Pyramid, ARampIsSampledAtThePixelCentres) {
  const OwnedImage image = testing::render(240, 200, [](double x, double y) { return 0.6 * x + 0.5 * y; });
  Pyramid pyramid(240, 200, {});
  pyramid.build(image.view());
  for (int l = 0; l < pyramid.levels(); ++l) {
    const ImageView level = pyramid.level(l);
    const double scale = pyramid.scale(l);
    double sum = 0;
    int count = 0;
    for (int y = 3; y < level.height_px - 3; ++y) {
      for (int x = 3; x < level.width_px - 3; ++x) {
        const double expected = 0.6 * ((x + 0.5) * scale - 0.5) + 0.5 * ((y + 0.5) * scale - 0.5);
        const double error = level.data[y * level.stride_bytes + x] - expected;
        ASSERT_LT(std::abs(error), 1.6) << "level " << l;  // one rounding a level
        sum += error;
        ++count;
      }
    }
    EXPECT_NEAR(sum / count, 0, 0.1) << "level " << l;
  }
}

// What a coarse level cannot show must be gone, not turned into false coarse structure.
TEST(Pyramid, FineStripesFadeInsteadOfAliasing) {
  const OwnedImage image = testing::render(
      400, 100, [](double x, double) { return 128 + 100 * std::cos(x * 2 * 3.141592653589793 / 2.5); });
  Pyramid pyramid(400, 100, {});
  pyramid.build(image.view());
  const ImageView level = pyramid.level(4);
  int low = 255, high = 0;
  for (int x = 5; x < level.width_px - 5; ++x) {
    const int v = level.data[20 * level.stride_bytes + x];
    low = std::min(low, v);
    high = std::max(high, v);
  }
  EXPECT_LT(high - low, 20);  // of 200 in level 0
}

TEST(Pyramid, OtherFactorsWork) {
  for (const double factor : {1.1, 1.41421356, 1.8}) {
    const OwnedImage image = testing::render(300, 220, [](double x, double y) {
      return 240 * std::exp(-((x - 150.3) * (x - 150.3) + (y - 99.6) * (y - 99.6)) / (2 * 20.0 * 20.0));
    });
    Pyramid pyramid(300, 220, {.levels = 4, .scale_factor = factor});
    pyramid.build(image.view());
    const ImageView level = pyramid.level(3);
    double sum = 0, sx = 0;
    for (int y = 0; y < level.height_px; ++y) {
      for (int x = 0; x < level.width_px; ++x) {
        const double v = level.data[y * level.stride_bytes + x];
        sum += v;
        sx += v * x;
      }
    }
    EXPECT_NEAR((sx / sum + 0.5) * std::pow(factor, 3) - 0.5, 150.3, 0.05) << factor;
  }
}

}  // namespace
}  // namespace farpoint::slam
