// SPDX-License-Identifier: Apache-2.0
// What a mask promises: nothing that is measured depends on a masked pixel.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "slam/image/extractor.h"
#include "slam/image/pyramid.h"
#include "tests/image/test_images.h"

namespace farpoint::slam {
namespace {

using testing::OwnedImage;

constexpr int kWidth = 480, kHeight = 360;

// The lower 23 % and a disc.
OwnedImage mask_pixels() {
  OwnedImage mask(kWidth, kHeight, 255);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      if (y >= 277 || std::hypot(x - 330, y - 90) < 30) mask.at(x, y) = 0;
  return mask;
}

ImageMask mask_of(const OwnedImage& pixels) {
  return {pixels.width, pixels.height, pixels.pixels};
}

// The image with other masked pixels.
OwnedImage with_other_content(OwnedImage image, std::uint64_t seed) {
  const OwnedImage mask = mask_pixels(), other = testing::rectangles(kWidth, kHeight, 900, seed);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      if (mask.at(x, y) == 0) image.at(x, y) = other.at(x, y);
  return image;
}

struct Built {
  explicit Built(const OwnedImage& image, const ImageMask* mask = nullptr)
      : pyramid(image.width, image.height, {}), frame(&pyramid, mask) {
    pyramid.build(image.view());
  }
  Pyramid pyramid;
  PyramidImage frame;
};

FeatureSet extract(const Pyramid& pyramid, const ImageMask* mask, int features = 1500) {
  Extractor extractor(kWidth, kHeight, {}, {.features = features});
  FeatureSet set;
  extractor.extract(pyramid, mask, &set);
  return set;
}

bool same(const FeatureSet& a, const FeatureSet& b) {
  if (a.features.size() != b.features.size()) return false;
  for (std::size_t i = 0; i < a.features.size(); ++i) {
    const Feature &f = a.features[i], &g = b.features[i];
    if (f.u_px != g.u_px || f.v_px != g.v_px || f.angle_rad != g.angle_rad || f.score != g.score ||
        f.level != g.level || !(a.descriptors[i] == b.descriptors[i]))
      return false;
  }
  return true;
}

TEST(Mask, FeaturesDoNotDependOnMaskedPixels) {
  const ImageMask mask = mask_of(mask_pixels());
  const OwnedImage image = testing::rectangles(kWidth, kHeight, 900, 1);
  const FeatureSet first = extract(Built(image).pyramid, &mask);
  EXPECT_GT(first.features.size(), 300U);
  for (const std::uint64_t seed : {2U, 3U, 4U})
    EXPECT_TRUE(same(first, extract(Built(with_other_content(image, seed)).pyramid, &mask))) << seed;
  // Without it they do.
  EXPECT_FALSE(same(extract(Built(image).pyramid, nullptr),
                    extract(Built(with_other_content(image, 2)).pyramid, nullptr)));
}

TEST(Mask, EveryLevelKeepsTheDistanceThatItNeedsAndNoMore) {
  const ImageMask mask = mask_of(mask_pixels());
  const Built built(testing::rectangles(kWidth, kHeight, 900, 1));
  std::vector<double> nearest(8, 1e9);
  const FeatureSet set = extract(built.pyramid, &mask, 6000);
  for (const Feature& f : set.features)
    nearest[f.level] = std::min(nearest[f.level], 277.0 - static_cast<double>(f.v_px));
  for (int level = 0; level < built.pyramid.levels(); ++level) {
    const double support = built.pyramid.support_px(level, 18), scale = built.pyramid.scale(level);
    EXPECT_GE(nearest[static_cast<std::size_t>(level)], support) << level;
    if (level >= 5) continue;
    EXPECT_LE(nearest[static_cast<std::size_t>(level)], support + 12 * scale) << level;
  }
}

// One pixel of the image changes: of every level only pixels change whose support it lies in.
TEST(Mask, SupportOfALevelHoldsAllPixelsThatItIsMadeOf) {
  const OwnedImage image = testing::rectangles(kWidth, kHeight, 900, 5);
  const Built before(image);
  for (const auto& [x, y] :
       {std::pair{100, 100}, std::pair{203, 151}, std::pair{0, 359}, std::pair{479, 7}}) {
    OwnedImage changed = image;
    changed.at(x, y) = static_cast<std::uint8_t>(changed.at(x, y) < 128 ? 255 : 0);
    const Built after(changed);
    for (int l = 0; l < before.pyramid.levels(); ++l) {
      const ImageView a = before.pyramid.level(l), b = after.pyramid.level(l);
      const double scale = before.pyramid.scale(l), support = before.pyramid.support_px(l, 0);
      for (int v = 0; v < a.height_px; ++v)
        for (int u = 0; u < a.width_px; ++u) {
          if (a.data[v * a.stride_bytes + u] == b.data[v * b.stride_bytes + u]) continue;
          EXPECT_LE(std::abs((u + 0.5) * scale - 0.5 - x), support + 1e-3) << l;
          EXPECT_LE(std::abs((v + 0.5) * scale - 0.5 - y), support + 1e-3) << l;
        }
    }
  }
}

// Patches of an image are aligned with itself, everywhere, with the masked part showing this or that.
TEST(Mask, PatchesAndAlignmentsDoNotDependOnMaskedPixels) {
  const ImageMask mask = mask_of(mask_pixels());
  const OwnedImage image = testing::rectangles(kWidth, kHeight, 900, 6);
  const Built first(image, &mask), second(with_other_content(image, 7), &mask), unmasked(image);
  FeatureSet set;
  for (int level = 0; level < 8; ++level)
    for (float v = 12; v < kHeight; v += 7)
      for (float u = 12; u < kWidth; u += 7)
        set.features.push_back({.u_px = u, .v_px = v, .level = static_cast<std::uint8_t>(level)});
  set.descriptors.resize(set.features.size());
  int aligned = 0, refused = 0;
  for (std::size_t i = 0; i < set.features.size(); ++i) {
    const Eigen::Vector2f at(set.features[i].u_px, set.features[i].v_px);
    Patch patch, of_first, of_second;
    const bool is_patch = first.frame.extract_patch(set, i, &of_first);
    ASSERT_EQ(second.frame.extract_patch(set, i, &of_second), is_patch);
    if (is_patch) {
      ASSERT_EQ(of_first.pixels, of_second.pixels);
    }
    if (!unmasked.frame.extract_patch(set, i, &patch)) continue;
    const Eigen::Matrix2f same_size = Eigen::Matrix2f::Identity();
    const Alignment a = first.frame.align(patch, same_size, at, 3),
                    b = second.frame.align(patch, same_size, at, 3);
    ASSERT_EQ(a.ok, b.ok) << at.transpose();
    ASSERT_TRUE(a.pixel == b.pixel && a.sigma_px == b.sigma_px) << at.transpose();
    aligned += a.ok ? 1 : 0;
    refused += !a.ok && unmasked.frame.align(patch, same_size, at, 3).ok ? 1 : 0;
    if (mask.touches(at.cast<double>(), 0)) {
      ASSERT_FALSE(a.ok) << at.transpose();
    }
  }
  EXPECT_GT(aligned, 3000);
  EXPECT_GT(refused, 1000);
}

// Like the alignment above, for the coarse search: patches of the image are looked for around their own
// place.
TEST(Mask, CorrelationsDoNotDependOnMaskedPixels) {
  const ImageMask mask = mask_of(mask_pixels());
  const OwnedImage image = testing::rectangles(kWidth, kHeight, 900, 8);
  const Built first(image, &mask), second(with_other_content(image, 9), &mask), unmasked(image);
  std::array<int, 8> compared{}, refused{};
  for (std::size_t level = 0; level < 8; ++level)
    for (float v = 20; v < kHeight; v += 7)
      for (float u = 20; u < kWidth; u += 7) {
        FeatureSet set;
        set.features.push_back({.u_px = u, .v_px = v, .level = static_cast<std::uint8_t>(level)});
        set.descriptors.emplace_back();
        Patch patch;
        if (!unmasked.frame.extract_patch(set, 0, &patch)) continue;
        std::array<Eigen::Vector2f, 9> places;
        for (std::size_t i = 0; i < places.size(); ++i)
          places[i] = {u + 3.3F * (static_cast<float>(i) - 4.0F), v + 0.4F * static_cast<float>(i)};
        std::array<float, 9> a, b, without;
        const Eigen::Matrix2f same_size = Eigen::Matrix2f::Identity();
        if (!unmasked.frame.correlate(patch, same_size, places, without)) continue;
        ASSERT_TRUE(first.frame.correlate(patch, same_size, places, a));
        ASSERT_TRUE(second.frame.correlate(patch, same_size, places, b));
        ASSERT_EQ(a, b) << level << " at " << u << ", " << v;
        for (std::size_t i = 0; i < places.size(); ++i) {
          // Masked or not, nothing between.
          ASSERT_TRUE(a[i] == without[i] || a[i] == -1.0F);
          if (mask.touches(places[i].cast<double>(), 0)) {
            ASSERT_EQ(a[i], -1.0F);
          }
          // The eight pixels of the window, as far as rounding may move it.
          const double reach_px = first.pyramid.support_px(static_cast<int>(level), 4.0);
          if (!mask.touches(places[i].cast<double>(), reach_px)) {
            ASSERT_EQ(a[i], without[i]);
          }
          ++(a[i] == without[i] ? compared : refused)[level];
        }
      }
  for (std::size_t level = 0; level < 8; ++level) {
    EXPECT_GT(compared[level], 1000) << level;
    EXPECT_GT(refused[level], 1000) << level;
  }
}

}  // namespace
}  // namespace farpoint::slam
