// SPDX-License-Identifier: Apache-2.0
#include "slam/image/extractor.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <numbers>

#include "slam/image/kernels.h"
#include "tests/image/test_images.h"

namespace farpoint::slam {
namespace {

using testing::OwnedImage;

FeatureSet extract(const OwnedImage& image, const ExtractorOptions& options = {},
                   const PyramidOptions& levels = {}, const ImageMask* mask = nullptr) {
  Pyramid pyramid(image.width, image.height, levels);
  pyramid.build(image.view());
  Extractor extractor(image.width, image.height, levels, options);
  FeatureSet set;
  extractor.extract(pyramid, mask, &set);
  EXPECT_EQ(set.features.size(), set.descriptors.size());
  return set;
}

bool same(const FeatureSet& a, const FeatureSet& b) {
  const auto equal = [](const Feature& x, const Feature& y) {
    return x.u_px == y.u_px && x.v_px == y.v_px && x.angle_rad == y.angle_rad && x.score == y.score &&
           x.level == y.level;
  };
  return std::equal(a.features.begin(), a.features.end(), b.features.begin(), b.features.end(), equal) &&
         a.descriptors == b.descriptors;
}

TEST(Extractor, GivesTheWantedNumberInTheDocumentedOrder) {
  const OwnedImage image = testing::rectangles(640, 400, 700, 1);
  const ExtractorOptions options{.features = 700};
  const FeatureSet set = extract(image, options);
  EXPECT_EQ(set.features.size(), 700U);
  for (std::size_t i = 1; i < set.features.size(); ++i) {
    const Feature &a = set.features[i - 1], &b = set.features[i];
    ASSERT_LE(a.level, b.level);
    if (a.level != b.level) continue;
    const double scale = std::pow(1.2, a.level);
    const auto cell = [&](float p) {
      return static_cast<int>(std::lround((p + 0.5) / scale - 0.5)) / options.cell_px;
    };
    ASSERT_LE(std::pair(cell(a.v_px), cell(a.u_px)), std::pair(cell(b.v_px), cell(b.u_px)));
  }
}

TEST(Extractor, GivesFewerWhereFewerAreAskedFor) {
  const OwnedImage image = testing::rectangles(640, 400, 700, 1);
  Pyramid pyramid(image.width, image.height, {});
  pyramid.build(image.view());
  Extractor extractor(image.width, image.height, {}, {.features = 700});
  FeatureSet set;
  extractor.extract(pyramid, {}, &set, 400);
  EXPECT_TRUE(same(set, extract(image, {.features = 400})));
  extractor.extract(pyramid, {}, &set, 5000);
  EXPECT_TRUE(same(set, extract(image, {.features = 700})));
}

// A corner sits on a whole pixel of its level, a patch away from the edge, and is one by its level's pixels.
TEST(Extractor, CornersSitOnWholePixelsOfTheirLevel) {
  const OwnedImage image = testing::rectangles(500, 380, 500, 2);
  Pyramid pyramid(500, 380, {});
  pyramid.build(image.view());
  const FeatureSet set = extract(image, {.features = 600});
  std::array<int, 8> per_level{};
  for (const Feature& f : set.features) {
    const double scale = std::pow(1.2, f.level);
    const double x = (f.u_px + 0.5) / scale - 0.5, y = (f.v_px + 0.5) / scale - 0.5;
    ASSERT_NEAR(x, std::round(x), 1e-3);
    ASSERT_NEAR(y, std::round(y), 1e-3);
    const ImageView level = pyramid.level(f.level);
    const int ix = static_cast<int>(std::lround(x)), iy = static_cast<int>(std::lround(y));
    ASSERT_GE(std::min(ix, iy), 19);
    ASSERT_LT(ix, level.width_px - 19);
    ASSERT_LT(iy, level.height_px - 19);
    std::vector<std::uint8_t> score(static_cast<std::size_t>(level.width_px), 0);
    plain_kernels().fast_score_row(level.data + iy * level.stride_bytes, level.stride_bytes, ix, ix + 1, 7,
                                   score.data());
    ASSERT_EQ(f.score, static_cast<float>(score[static_cast<std::size_t>(ix)]));
    ++per_level[f.level];
  }
  for (const int n : per_level) EXPECT_GT(n, 20);
}

TEST(Extractor, IsDeterministicOverRunsAndInstructionSets) {
  const OwnedImage image = testing::rectangles(421, 317, 400, 3);
  const FeatureSet first = extract(image, {.features = 900});
  EXPECT_TRUE(same(first, extract(image, {.features = 900})));
  ASSERT_TRUE(pin_kernels("plain"));
  EXPECT_TRUE(same(first, extract(image, {.features = 900})));
  for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1) {
    const char* name = hwy::TargetName(targets & -targets);
    if (!pin_kernels(name)) continue;  // the scalar target is the plain version
    EXPECT_TRUE(same(first, extract(image, {.features = 900}))) << name;
  }
  ASSERT_TRUE(pin_kernels("auto"));
}

// An extractor carries nothing over from one image to the next.
TEST(Extractor, EarlierImagesLeaveNoTrace) {
  const OwnedImage a = testing::rectangles(421, 317, 400, 4), b = testing::rectangles(421, 317, 60, 5);
  Pyramid pyramid(421, 317, {});
  Extractor extractor(421, 317, {}, {});
  FeatureSet set;
  pyramid.build(a.view());
  extractor.extract(pyramid, {}, &set);
  pyramid.build(b.view());
  extractor.extract(pyramid, {}, &set);
  EXPECT_TRUE(same(set, extract(b)));
}

TEST(Extractor, AFlatImageGivesNothing) {
  EXPECT_TRUE(extract(OwnedImage(320, 240, 90)).features.empty());
  EXPECT_TRUE(extract(OwnedImage(37, 37, 90)).features.empty());  // smaller than two borders
}

TEST(Extractor, MaskedPixelsGiveNoCorner) {
  const OwnedImage image = testing::rectangles(400, 300, 400, 6);
  OwnedImage pixels(400, 300, 255);
  for (int y = 0; y < 300; ++y) {
    for (int x = 150; x < 400; ++x) pixels.at(x, y) = 0;
  }
  const ImageMask mask(400, 300, pixels.pixels);
  const FeatureSet set = extract(image, {.features = 400}, {}, &mask);
  EXPECT_GT(set.features.size(), 100U);
  for (const Feature& f : set.features) EXPECT_LT(f.u_px, 150 - 18);
  const ImageMask everything(400, 300, OwnedImage(400, 300, 0).pixels);
  EXPECT_TRUE(extract(image, {}, {}, &everything).features.empty());
}

// The left part has strong corners everywhere, the right part only weak ones: they must not be crowded out.
TEST(Extractor, FeaturesSpreadOverTheImage) {
  OwnedImage image = testing::rectangles(600, 300, 800, 7);
  for (int y = 0; y < 300; ++y) {
    for (int x = 300; x < 600; ++x) image.at(x, y) = static_cast<std::uint8_t>(118 + image.at(x, y) / 12);
  }
  const FeatureSet set = extract(image, {.features = 400});
  ASSERT_EQ(set.features.size(), 400U);
  const auto right =
      std::count_if(set.features.begin(), set.features.end(), [](const Feature& f) { return f.u_px > 300; });
  EXPECT_GT(right, 130);
  EXPECT_LT(right, 270);
}

TEST(Extractor, TheLowerThresholdServesOnlyCellsWithoutStrongCorners) {
  OwnedImage image(400, 300, 100);
  const auto square = [&](int x0, int y0, int value) {
    for (int y = y0; y < y0 + 12; ++y) {
      for (int x = x0; x < x0 + 12; ++x) image.at(x, y) = static_cast<std::uint8_t>(value);
    }
  };
  // Cells of 64 px. Squares of 12 px with contrast 100, or 12 (between the thresholds 7 and 20).
  square(70, 70, 200);    // cell (1, 1): strong
  square(100, 100, 112);  // cell (1, 1): weak, must lose
  square(210, 210, 112);  // cell (3, 3): weak, alone
  const FeatureSet set = extract(image, {.features = 500, .cell_px = 64}, {.levels = 1});
  const auto near = [&](double x0, double y0) {
    return std::count_if(set.features.begin(), set.features.end(), [&](const Feature& f) {
      return f.u_px > x0 - 4 && f.u_px < x0 + 16 && f.v_px > y0 - 4 && f.v_px < y0 + 16;
    });
  };
  EXPECT_GE(near(70, 70), 4);
  EXPECT_EQ(near(100, 100), 0);
  EXPECT_GE(near(210, 210), 4);
}

// A texture and the same texture turned by `angle` about the image centre; the true place of a feature in the
// second.
struct TurnedPair {
  OwnedImage first, second;
  double angle;
  [[nodiscard]] Eigen::Vector2d map(double u, double v) const {
    const double c = std::cos(angle), s = std::sin(angle), x = u - 200, y = v - 200;
    return {200 + c * x - s * y, 200 + s * x + c * y};
  }
};

TurnedPair make_turned_pair(double angle) {
  const testing::Texture texture(8, 5.0, 45);
  TurnedPair pair;
  pair.angle = angle;
  pair.first = testing::render(401, 401, texture, 1.0, 1);
  const double c = std::cos(angle), s = std::sin(angle);
  pair.second = testing::render(
      401, 401,
      [&](double u, double v) {
        const double x = u - 200, y = v - 200;
        return texture(200 + c * x + s * y, 200 - s * x + c * y);
      },
      1.0, 2);
  return pair;
}

struct TurnedMatch {
  double angle_error_rad;
  int distance;
};

// Pairs of features of level <= 2 that are the same place within a pixel, whatever their descriptors say.
std::vector<TurnedMatch> match_by_place(const TurnedPair& pair, double* rival_distance) {
  const FeatureSet a = extract(pair.first, {.features = 800}), b = extract(pair.second, {.features = 800});
  std::vector<TurnedMatch> matches;
  double rivals = 0;
  for (std::size_t i = 0; i < a.features.size(); ++i) {
    const Eigen::Vector2d p = pair.map(a.features[i].u_px, a.features[i].v_px);
    const std::size_t other = (i * 7 + 3) % b.features.size();
    for (std::size_t j = 0; j < b.features.size(); ++j) {
      if (a.features[i].level > 2 || b.features[j].level != a.features[i].level) continue;
      if (std::hypot(b.features[j].u_px - p.x(), b.features[j].v_px - p.y()) > 1.0) continue;
      const double turn = b.features[j].angle_rad - a.features[i].angle_rad - pair.angle;
      matches.push_back(
          {std::remainder(turn, 2 * std::numbers::pi), hamming_distance(a.descriptors[i], b.descriptors[j])});
      rivals += hamming_distance(a.descriptors[i], b.descriptors[other]);
      break;
    }
  }
  *rival_distance = rivals / static_cast<double>(std::max<std::size_t>(1, matches.size()));
  return matches;
}

TEST(Extractor, OrientationFollowsARotationAndDescriptorsDoNotChange) {
  for (const double degrees : {0.0, 10.0, 37.0, 90.0, 145.0, 180.0, -60.0}) {
    const TurnedPair pair = make_turned_pair(degrees * std::numbers::pi / 180);
    double rival_distance = 0;
    std::vector<TurnedMatch> matches = match_by_place(pair, &rival_distance);
    ASSERT_GT(matches.size(), 60U) << degrees;
    std::vector<double> angle_errors, distances;
    for (const TurnedMatch& m : matches) {
      angle_errors.push_back(std::abs(m.angle_error_rad));
      distances.push_back(m.distance);
    }
    std::sort(angle_errors.begin(), angle_errors.end());
    std::sort(distances.begin(), distances.end());
    EXPECT_LT(angle_errors[angle_errors.size() / 2], 0.10) << degrees;  // places agree within a pixel only
    EXPECT_LT(distances[distances.size() / 2], 40) << degrees;
    EXPECT_GT(rival_distance, 100) << degrees;
  }
}

// On a ramp the centroid is exactly uphill.
TEST(Extractor, OrientationPointsUphill) {
  for (int k = 0; k < 24; ++k) {
    const double angle = k * std::numbers::pi / 12 - std::numbers::pi + 0.05;
    OwnedImage image = testing::render(64, 64, [&](double x, double y) {
      return 128 + 2.5 * ((x - 32) * std::cos(angle) + (y - 32) * std::sin(angle));
    });
    const CentroidMoments m = plain_kernels().centroid(&image.at(32, 32), image.width);
    EXPECT_NEAR(std::remainder(std::atan2(m.m01, m.m10) - angle, 2 * std::numbers::pi), 0, 0.01);
  }
}

TEST(Extractor, DescriptorsSurviveNoiseAndBrightness) {
  const testing::Texture texture(9, 5.0, 40);
  const OwnedImage a = testing::render(400, 300, texture, 2.0, 1);
  const OwnedImage b = testing::render(
      400, 300, [&](double x, double y) { return 0.7 * texture(x, y) + 10; }, 2.0, 2);
  const FeatureSet fa = extract(a, {.features = 500}), fb = extract(b, {.features = 500});
  std::vector<int> distances;
  for (std::size_t i = 0; i < fa.features.size(); ++i) {
    for (std::size_t j = 0; j < fb.features.size(); ++j) {
      if (fa.features[i].level == fb.features[j].level && fa.features[i].u_px == fb.features[j].u_px &&
          fa.features[i].v_px == fb.features[j].v_px) {
        distances.push_back(hamming_distance(fa.descriptors[i], fb.descriptors[j]));
      }
    }
  }
  ASSERT_GT(distances.size(), 100U);
  std::sort(distances.begin(), distances.end());
  EXPECT_LT(distances[distances.size() / 2], 30);
}

}  // namespace
}  // namespace farpoint::slam
