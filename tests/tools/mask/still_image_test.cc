// SPDX-License-Identifier: Apache-2.0
#include "tools/mask/still_image.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "tests/support/bonnet.h"
#include "tools/mask/grid.h"

namespace farpoint::tools {
namespace {

constexpr int kWidth = 640, kHeight = 400;

// Waves that move with the offset, and a flat sky above a skyline that moves with them.
ipc::GreyImage scene(double offset_px) {
  ipc::GreyImage image{kWidth, kHeight, {}};
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double u = x + offset_px * (0.5 + 0.002 * y), v = y + 0.7 * offset_px;
      const double wave = 30 * std::sin(u / 7) * std::cos(v / 9) + 30 * std::sin(u / 23 + v / 17);
      image.pixels.push_back(
          static_cast<std::uint8_t>(y < 120 + 12 * std::sin(u / 31) ? 240 : std::lround(128 + wave)));
    }
  return image;
}

struct Overlap {
  double iou = 0, covered = 0, scene_covered = 0;
};
Overlap overlap(const std::vector<std::uint8_t>& proposed, const std::vector<std::uint8_t>& truth) {
  double both = 0, either = 0, in_truth = 0, beside = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    both += proposed[i] == 0 && truth[i] == 0 ? 1 : 0;
    either += proposed[i] == 0 || truth[i] == 0 ? 1 : 0;
    in_truth += truth[i] == 0 ? 1 : 0;
    beside += proposed[i] == 0 && truth[i] != 0 ? 1 : 0;
  }
  return {both / either, both / in_truth, beside / (static_cast<double>(truth.size()) - in_truth)};
}

double masked_share(const std::vector<std::uint8_t>& mask) {
  return static_cast<double>(std::count(mask.begin(), mask.end(), std::uint8_t{0})) /
         static_cast<double>(mask.size());
}

TEST(StillImage, ProposesTheBonnetAndNothingElse) {
  for (const double noise : {0.0, 6.0}) {
    test::Bonnet bonnet(kWidth, kHeight, {.noise = noise});
    StillImage still(kWidth, kHeight);
    for (int i = 0; i < 60; ++i) {
      ipc::GreyImage image = scene(11.0 * i + 0.03 * i * i);
      bonnet.paint(&image.pixels);
      still.add(image);
    }
    EXPECT_GE(still.counted(), StillImage::kLeastImages);
    const Overlap result = overlap(still.propose(), bonnet.mask());
    EXPECT_GT(result.iou, 0.85) << noise;
    EXPECT_GT(result.covered, 0.95) << noise;
    EXPECT_LT(result.scene_covered, 0.04) << noise;
  }
}

TEST(StillImage, AFlatSkyIsNotStill) {
  StillImage still(kWidth, kHeight);
  for (int i = 0; i < 60; ++i) still.add(scene(11.0 * i + 0.03 * i * i));
  EXPECT_GE(still.counted(), StillImage::kLeastImages);
  EXPECT_EQ(masked_share(still.propose()), 0.0);
}

// A level horizon that keeps its height encloses nothing.
TEST(StillImage, ASkyAboveAStillEdgeIsNotStill) {
  StillImage still(kWidth, kHeight);
  for (int i = 0; i < 60; ++i) {
    ipc::GreyImage image = scene(11.0 * i + 0.03 * i * i);
    std::fill_n(image.pixels.begin(), kWidth * 140, std::uint8_t{240});
    still.add(image);
  }
  EXPECT_LT(masked_share(still.propose()), 0.1);
}

// A guard rail of a straight road keeps its place, except that the vehicle pitches and rolls a little.
TEST(StillImage, WhatStaysNearlyInItsPlaceIsNotStill) {
  StillImage still(kWidth, kHeight);
  for (int i = 0; i < 60; ++i) {
    ipc::GreyImage image = scene(11.0 * i + 0.03 * i * i);
    const int shake = static_cast<int>(std::lround(3.5 * std::sin(2.1 * i)));
    for (int y = 300 + shake; y < 324 + shake; ++y)
      std::fill_n(image.pixels.begin() + y * kWidth, kWidth,
                  static_cast<std::uint8_t>((y - shake) / 12 % 2 * 180));
    still.add(image);
  }
  EXPECT_GE(still.counted(), StillImage::kLeastImages);
  EXPECT_EQ(masked_share(still.propose()), 0.0);
}

TEST(StillImage, AFlatPartThatStillOnesEncloseIsStill) {
  StillImage still(kWidth, kHeight);
  // A frame of stripes around a flat middle, at the lower edge.
  const auto in = [](int x, int y, int margin) {
    return x >= 200 + margin && x < 440 - margin && y >= 280 + margin;
  };
  for (int i = 0; i < 60; ++i) {
    ipc::GreyImage image = scene(11.0 * i + 0.03 * i * i);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        if (in(x, y, 0))
          image.pixels[static_cast<std::size_t>(y * kWidth + x)] =
              in(x, y, 20) ? 100 : static_cast<std::uint8_t>(60 + 120 * ((x + y) / 8 % 2));
    still.add(image);
  }
  const std::vector<std::uint8_t> mask = still.propose();
  EXPECT_EQ(mask[static_cast<std::size_t>(350 * kWidth + 320)], 0);
  EXPECT_EQ(mask[static_cast<std::size_t>(200 * kWidth + 320)], 255);
  EXPECT_NEAR(masked_share(mask), 240.0 * 120 / (kWidth * kHeight), 0.03);
}

TEST(StillImage, AVehicleThatStandsShowsNothing) {
  StillImage still(kWidth, kHeight);
  for (int i = 0; i < 30; ++i) still.add(scene(11.0 * i));
  const int counted = still.counted();
  // Before the lights, with a car that passes over a tenth of the image.
  for (int i = 0; i < 100; ++i) {
    ipc::GreyImage image = scene(330.0);
    for (int y = 200; y < 300; ++y)
      for (int x = 6 * i; x < std::min(kWidth, 6 * i + 200); ++x)
        image.pixels[static_cast<std::size_t>(y * kWidth + x)] = static_cast<std::uint8_t>(x / 9 % 2 * 200);
    still.add(image);
  }
  EXPECT_LE(still.counted(), counted + 1);
}

TEST(Grid, ClosingKeepsTheEdgeAndFillsGaps) {
  Bits bits(20, 10);
  for (int y = 6; y < 10; ++y)
    for (int x = 0; x < 20; ++x) bits.at(x, y) = x == 9 || x == 10 ? 0 : 1;
  const Bits result = closed(bits, 2);
  for (int y = 0; y < 10; ++y)
    for (int x = 0; x < 20; ++x) EXPECT_EQ(result.at(x, y), y >= 6 ? 1 : 0) << x << ' ' << y;
}

TEST(Grid, ComponentsAreFourConnected) {
  Bits bits(4, 3);
  bits.at(0, 0) = bits.at(1, 0) = bits.at(2, 1) = 1;
  std::vector<std::size_t> sizes;
  for_each_component(bits, [&](const std::vector<std::size_t>& part) { sizes.push_back(part.size()); });
  EXPECT_EQ(sizes, (std::vector<std::size_t>{2, 1}));
}

}  // namespace
}  // namespace farpoint::tools
