// SPDX-License-Identifier: Apache-2.0
// Patch alignment against exact truth: formulas, and recorded images whose pixels are put together to coarser
// ones so that two images with a known sub-pixel shift or scale arise without any interpolation.
#include <gtest/gtest.h>

#include <Eigen/LU>

#include <algorithm>
#include <numbers>

#include "slam/image/extractor.h"
#include "slam/image/pyramid.h"
#include "tests/image/test_images.h"

namespace farpoint::slam {
namespace {

using testing::OwnedImage;

struct BuiltImage {
  explicit BuiltImage(const OwnedImage& image) : pyramid(image.width, image.height, {}), frame(&pyramid) {
    pyramid.build(image.view());
  }
  Pyramid pyramid;
  PyramidImage frame;
};

FeatureSet extract(const Pyramid& pyramid, int features) {
  const ImageView base = pyramid.level(0);
  Extractor extractor(base.width_px, base.height_px, {}, {.features = features});
  FeatureSet set;
  extractor.extract(pyramid, {}, &set);
  return set;
}

FeatureSet one_feature(float u, float v, int level = 0) {
  FeatureSet set;
  set.features.push_back({.u_px = u, .v_px = v, .level = static_cast<std::uint8_t>(level)});
  set.descriptors.emplace_back();
  return set;
}

struct Errors {
  int tried = 0, ok = 0, beyond_three_sigma = 0;
  double bias_x = 0, bias_y = 0;       // level pixels
  double rms = 0, normalised_rms = 0;  // an axis; level pixels, sigmas
  double median = 0;                   // of the distance, level pixels

  void add(const Eigen::Vector2d& error, const Alignment& a, double scale) {
    ++ok;
    bias_x += error.x() / scale;
    bias_y += error.y() / scale;
    rms += error.squaredNorm() / (scale * scale);
    normalised_rms += error.squaredNorm() / (a.sigma_px * a.sigma_px);
    beyond_three_sigma += error.cwiseAbs().maxCoeff() > 3 * a.sigma_px;
    distances.push_back(error.norm() / scale);
  }
  void finish() {
    bias_x /= ok;
    bias_y /= ok;
    rms = std::sqrt(rms / (2 * ok));
    normalised_rms = std::sqrt(normalised_rms / (2 * ok));
    std::sort(distances.begin(), distances.end());
    median = distances.empty() ? 1e9 : distances[distances.size() / 2];
    ::testing::Test::RecordProperty("ok_of_tried", std::to_string(ok) + "/" + std::to_string(tried));
    std::printf(
        "  ok %d of %d, bias %+.3f %+.3f, median %.3f, rms %.3f level px, rms/sigma %.2f, beyond 3 sigma "
        "%.4f\n",
        ok, tried, bias_x, bias_y, median, rms, normalised_rms, static_cast<double>(beyond_three_sigma) / ok);
  }
  std::vector<double> distances;
};

// Aligns every feature of `host` with `target`; `map` is the truth, A its derivative, predictions are off by
// `start_sigma` level pixels.
template <typename Map>
Errors align_all(const OwnedImage& host_image, const OwnedImage& target_image, const Map& map,
                 const Eigen::Matrix2f& A, double start_sigma, int features = 500) {
  const BuiltImage host(host_image), target(target_image);
  const FeatureSet set = extract(host.pyramid, features);
  std::mt19937_64 rng(99);
  Errors errors;
  for (std::size_t i = 0; i < set.features.size(); ++i) {
    Patch patch;
    if (!host.frame.extract_patch(set, i, &patch)) continue;
    const Feature& f = set.features[i];
    const Eigen::Vector2d truth = map(Eigen::Vector2d(f.u_px, f.v_px));
    const double margin = 30;
    if (truth.x() < margin || truth.y() < margin || truth.x() > target_image.width - margin ||
        truth.y() > target_image.height - margin) {
      continue;
    }
    const double scale = host.pyramid.scale(f.level) * std::sqrt(static_cast<double>(A.determinant()));
    const Eigen::Vector2d start =
        truth + start_sigma * scale * Eigen::Vector2d(testing::normal(rng), testing::normal(rng));
    ++errors.tried;
    const Alignment a = target.frame.align(patch, A, start.cast<float>(), static_cast<float>(6 * scale));
    if (a.ok) errors.add(a.pixel.cast<double>() - truth, a, scale);
  }
  errors.finish();
  return errors;
}

const Eigen::Matrix2f kIdentity = Eigen::Matrix2f::Identity();

TEST(ExtractPatch, CopiesTheLevelAroundTheCorner) {
  const BuiltImage image(testing::rectangles(300, 200, 200, 1));
  for (int l = 0; l < 8; ++l) {
    const float scale = image.pyramid.scale(l);
    const int x = 20, y = 17;
    const FeatureSet set = one_feature((x + 0.5F) * scale - 0.5F, (y + 0.5F) * scale - 0.5F, l);
    Patch patch;
    ASSERT_TRUE(image.frame.extract_patch(set, 0, &patch));
    EXPECT_EQ(patch.level, l);
    const ImageView level = image.pyramid.level(l);
    for (int j = 0; j < Patch::kSize; ++j) {
      for (int i = 0; i < Patch::kSize; ++i) {
        ASSERT_EQ(patch.pixels[static_cast<std::size_t>(j * Patch::kSize + i)],
                  level.data[(y - Patch::kCentre + j) * level.stride_bytes + x - Patch::kCentre + i]);
      }
    }
  }
}

TEST(ExtractPatch, RefusesTheEdge) {
  const BuiltImage image(testing::rectangles(300, 200, 200, 1));
  Patch patch;
  EXPECT_TRUE(image.frame.extract_patch(one_feature(8, 8), 0, &patch));
  EXPECT_TRUE(image.frame.extract_patch(one_feature(292, 192), 0, &patch));
  for (const auto& [u, v] : {std::pair{7.F, 50.F}, {50.F, 7.F}, {293.F, 50.F}, {50.F, 193.F}, {-5.F, 50.F}}) {
    EXPECT_FALSE(image.frame.extract_patch(one_feature(u, v), 0, &patch)) << u << " " << v;
  }
  EXPECT_FALSE(image.frame.extract_patch(one_feature(150, 100, 8), 0, &patch));  // no such level
}

TEST(Align, MeasuresSubPixelShiftsWithoutBias) {
  const testing::Texture texture(3, 5.0, 40);
  const OwnedImage host = testing::render(420, 320, texture, 1.5, 1);
  for (const auto& [dx, dy] : {std::pair{0.0, 0.0}, {0.25, -0.25}, {0.5, 0.5}, {-0.37, 0.12}, {3.8, -2.3}}) {
    const OwnedImage target = testing::render(
        420, 320, [&, sx = dx, sy = dy](double x, double y) { return texture(x - sx, y - sy); }, 1.5, 2);
    const Eigen::Vector2d shift(dx, dy);
    const Errors e = align_all(
        host, target, [&](const Eigen::Vector2d& p) -> Eigen::Vector2d { return p + shift; }, kIdentity, 0.5);
    EXPECT_GT(e.ok, 0.95 * e.tried);
    EXPECT_LT(std::abs(e.bias_x), 0.02);
    EXPECT_LT(std::abs(e.bias_y), 0.02);
    EXPECT_LT(e.rms, 0.08);
    EXPECT_LT(e.normalised_rms, 1.2);
    EXPECT_LT(e.beyond_three_sigma, 0.02 * e.ok);
  }
}

TEST(Align, FollowsRotationScaleAndShear) {
  const testing::Texture texture(4, 6.0, 40);
  const OwnedImage host = testing::render(420, 420, texture, 1.0, 1);
  const auto rotation = [](double degrees, double scale) {
    const double a = degrees * std::numbers::pi / 180;
    Eigen::Matrix2d m;
    m << std::cos(a), -std::sin(a), std::sin(a), std::cos(a);
    return Eigen::Matrix2d(scale * m);
  };
  Eigen::Matrix2d shear;
  shear << 1.1, 0.3, -0.1, 0.9;
  for (const Eigen::Matrix2d& M : {rotation(12, 1.0), rotation(-40, 1.0), rotation(120, 1.0),
                                   rotation(5, 1.6), rotation(0, 0.7), rotation(20, 1.25), shear}) {
    const Eigen::Vector2d centre(210, 210);
    const Eigen::Matrix2d inverse = M.inverse();
    const OwnedImage target = testing::render(
        420, 420,
        [&](double x, double y) {
          const Eigen::Vector2d p = inverse * (Eigen::Vector2d(x, y) - centre) + centre;
          return texture(p.x(), p.y());
        },
        1.0, 2);
    const Errors e = align_all(
        host, target, [&](const Eigen::Vector2d& p) -> Eigen::Vector2d { return M * (p - centre) + centre; },
        M.cast<float>(), 0.5);
    ASSERT_GT(e.tried, 100);
    EXPECT_GT(e.ok, 0.75 * e.tried) << M;
    EXPECT_LT(std::abs(e.bias_x), 0.02) << M;
    EXPECT_LT(std::abs(e.bias_y), 0.02) << M;
    EXPECT_LT(e.normalised_rms, 1.2) << M;
    EXPECT_LT(e.beyond_three_sigma, 0.02 * e.ok + 1) << M;
  }
}

TEST(Align, ToleratesGainAndOffset) {
  const testing::Texture texture(5, 6.0, 30);
  const OwnedImage host = testing::render(400, 300, texture, 1.0, 1);
  const OwnedImage target = testing::render(
      400, 300, [&](double x, double y) { return 0.6 * texture(x - 0.3, y) + 80; }, 1.0, 2);
  const Errors e = align_all(
      host, target, [](const Eigen::Vector2d& p) -> Eigen::Vector2d { return p + Eigen::Vector2d(0.3, 0); },
      kIdentity, 0.5);
  EXPECT_GT(e.ok, 0.9 * e.tried);
  EXPECT_LT(std::abs(e.bias_x), 0.02);
  EXPECT_LT(e.rms, 0.08);
}

// Error and reported sigma scale with the noise.
TEST(Align, TheClaimedErrorGrowsWithTheNoise) {
  const testing::Texture texture(6, 7.0, 20);
  double previous = 0;
  for (const double noise : {1.0, 3.0, 8.0}) {
    const OwnedImage host = testing::render(400, 300, texture, noise, 1),
                     target = testing::render(400, 300, texture, noise, 2);
    const BuiltImage a(host), b(target);
    const FeatureSet set = extract(a.pyramid, 300);
    std::vector<double> claims;
    for (std::size_t i = 0; i < set.features.size(); ++i) {
      Patch patch;
      if (set.features[i].level != 0 || !a.frame.extract_patch(set, i, &patch)) continue;
      const Alignment r = b.frame.align(patch, kIdentity, {set.features[i].u_px, set.features[i].v_px}, 5);
      if (r.ok) claims.push_back(r.sigma_px);
    }
    ASSERT_GT(claims.size(), 20U);
    std::sort(claims.begin(), claims.end());
    EXPECT_GT(claims[claims.size() / 2], 1.2 * previous) << noise;
    previous = claims[claims.size() / 2];
    const Errors e = align_all(
        host, target, [](const Eigen::Vector2d& p) { return p; }, kIdentity, 0.3);
    EXPECT_LT(e.normalised_rms, 1.2) << noise;
  }
}

// Coarser pixel (x, y) = mean of factor x factor recorded pixels from (x factor + ox, y factor + oy) on, plus
// noise.
OwnedImage put_together(const OwnedImage& fine, int factor, int ox, int oy, double noise,
                        std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  OwnedImage image((fine.width - 8) / factor - 1, (fine.height - 8) / factor - 1);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      int sum = 0;
      for (int j = 0; j < factor; ++j) {
        for (int i = 0; i < factor; ++i) sum += fine.at(x * factor + i + ox, y * factor + j + oy);
      }
      const double mean = static_cast<double>(sum) / (factor * factor);
      image.at(x, y) =
          static_cast<std::uint8_t>(std::clamp(std::lround(mean + noise * testing::normal(rng)), 0L, 255L));
    }
  }
  return image;
}

class AlignRecorded : public ::testing::TestWithParam<std::string> {};

// The same lattice of positions a camera sees: fractions of a pixel between two frames. This is where
// interpolation and aliasing would pull towards whole pixels.
TEST_P(AlignRecorded, ShiftsAreMeasuredWithoutBiasAndWithinTheClaim) {
  const OwnedImage fine = testing::read_recorded(GetParam());
  if (fine.width == 0) GTEST_SKIP() << "no recordings in ../shared/data";
  for (const int factor : {3, 4}) {
    for (const auto& [ox, oy] : {std::pair{0, 0}, {1, 0}, {1, 2}}) {
      const OwnedImage host = put_together(fine, factor, 0, 0, 1.0, 1),
                       target = put_together(fine, factor, ox, oy, 1.0, 2);
      const Eigen::Vector2d shift(-static_cast<double>(ox) / factor, -static_cast<double>(oy) / factor);
      const Errors e = align_all(
          host, target, [&](const Eigen::Vector2d& p) -> Eigen::Vector2d { return p + shift; }, kIdentity,
          0.5);
      ASSERT_GT(e.tried, 100);
      EXPECT_GT(e.ok, 0.97 * e.tried);
      EXPECT_LT(std::abs(e.bias_x), 0.02);
      EXPECT_LT(std::abs(e.bias_y), 0.02);
      EXPECT_LT(e.median, 0.05);
      EXPECT_LT(e.normalised_rms, 1.0);
      EXPECT_LT(e.beyond_three_sigma, 0.02 * e.ok);
    }
  }
}

TEST_P(AlignRecorded, ChangesOfScaleAreMeasuredWithinTheClaim) {
  const OwnedImage fine = testing::read_recorded(GetParam());
  if (fine.width == 0) GTEST_SKIP() << "no recordings in ../shared/data";
  for (const auto& [from, to] : {std::pair{3, 4}, {4, 3}, {2, 3}, {4, 2}}) {
    const OwnedImage host = put_together(fine, from, 0, 0, 1.0, 1),
                     target = put_together(fine, to, 1, 1, 1.0, 2);
    const double ratio = static_cast<double>(from) / to, offset = 1.0 / to;
    const Errors e = align_all(
        host, target,
        [&](const Eigen::Vector2d& p) -> Eigen::Vector2d {
          return ((p.array() + 0.5) * ratio - offset - 0.5).matrix();
        },
        kIdentity* static_cast<float>(ratio), 0.5);
    ASSERT_GT(e.tried, 100);
    EXPECT_GT(e.ok, 0.9 * e.tried);
    // The mean of e.ok errors is uncertain itself.
    const double uncertainty = e.rms / std::sqrt(e.ok);
    EXPECT_LT(std::abs(e.bias_x), 0.02 + 2 * uncertainty);
    EXPECT_LT(std::abs(e.bias_y), 0.02 + 2 * uncertainty);
    EXPECT_LT(e.normalised_rms, 1.0);
    EXPECT_LT(e.beyond_three_sigma, 0.02 * e.ok);
  }
}

INSTANTIATE_TEST_SUITE_P(Kitti, AlignRecorded,
                         ::testing::Values("kitti/sequences/03/image_0/000010.jpg",
                                           "kitti/sequences/03/image_0/000200.jpg"));
INSTANTIATE_TEST_SUITE_P(Euroc, AlignRecorded,
                         ::testing::Values("euroc/MH_01_part/mav0/cam0/data/1403636584763555584.jpg"));

// ---- Refusals: a wrong measurement is worse than none.

class AlignRefuses : public ::testing::Test {
 protected:
  AlignRefuses() : image_(testing::render(200, 160, testing::Texture(7, 6.0, 40), 1.0, 1)) {
    EXPECT_TRUE(image_.frame.extract_patch(one_feature(100, 80), 0, &patch_));
  }
  BuiltImage image_;
  Patch patch_;
};

TEST_F(AlignRefuses, NothingWhenAllIsWell) {
  const Alignment a = image_.frame.align(patch_, kIdentity, {100.6F, 79.5F}, 3);
  ASSERT_TRUE(a.ok);
  EXPECT_NEAR(a.pixel.x(), 100, 0.01);
  EXPECT_NEAR(a.pixel.y(), 80, 0.01);
  EXPECT_GT(a.zncc, 0.99);
  EXPECT_GT(a.sigma_px, 0.03);
  EXPECT_LT(a.sigma_px, 0.3);
}

TEST_F(AlignRefuses, AMoveFurtherThanAllowed) {
  EXPECT_TRUE(image_.frame.align(patch_, kIdentity, {100.8F, 80}, 1.0F).ok);
  EXPECT_FALSE(image_.frame.align(patch_, kIdentity, {100.8F, 80}, 0.5F).ok);
}

TEST_F(AlignRefuses, OutsideTheImage) {
  for (const auto& p :
       {Eigen::Vector2f(2, 80), Eigen::Vector2f(100, 2), Eigen::Vector2f(198, 80), Eigen::Vector2f(100, 158),
        Eigen::Vector2f(-50, 80), Eigen::Vector2f(1e9F, 80), Eigen::Vector2f(std::nanf(""), 80)}) {
    EXPECT_FALSE(image_.frame.align(patch_, kIdentity, p, 5).ok) << p.transpose();
  }
}

TEST_F(AlignRefuses, AnotherPlace) {
  std::mt19937_64 rng(1);
  int ok = 0, tried = 0;
  for (int i = 0; i < 500; ++i) {
    const double u = 25 + 150 * testing::uniform(rng), v = 25 + 110 * testing::uniform(rng);
    if (std::hypot(u - 100, v - 80) < 10) continue;
    ++tried;
    ok += image_.frame.align(patch_, kIdentity, {static_cast<float>(u), static_cast<float>(v)}, 4).ok;
  }
  // By chance: at the corners of recorded frames it is 2-4 %.
  EXPECT_GT(tried, 400);
  EXPECT_LT(ok, 0.04 * tried);
}

TEST_F(AlignRefuses, AFlatHost) {
  Patch flat = patch_;
  flat.pixels.fill(100);
  EXPECT_FALSE(image_.frame.align(flat, kIdentity, {100, 80}, 5).ok);
}

TEST_F(AlignRefuses, AFlatTarget) {
  const BuiltImage flat(OwnedImage(200, 160, 100));
  EXPECT_FALSE(flat.frame.align(patch_, kIdentity, {100, 80}, 5).ok);
}

// Along an edge the position is free: the aperture problem.
TEST_F(AlignRefuses, AnEdge) {
  for (const double degrees : {0.0, 30.0, 90.0, 135.0}) {
    const double a = degrees * std::numbers::pi / 180;
    const BuiltImage edge(testing::render(
        200, 160,
        [&](double x, double y) {
          return 128 + 80 * std::tanh(((x - 100) * std::cos(a) + (y - 80) * std::sin(a)) / 1.5);
        },
        1.0, 3));
    Patch patch;
    ASSERT_TRUE(edge.frame.extract_patch(one_feature(100, 80), 0, &patch));
    int ok = 0;
    for (int i = 0; i < 20; ++i) {
      const float along = static_cast<float>(i) - 10;
      const Eigen::Vector2f start(100 - along * static_cast<float>(std::sin(a)),
                                  80 + along * static_cast<float>(std::cos(a)));
      ok += edge.frame.align(patch, kIdentity, start, 20).ok;
    }
    EXPECT_EQ(ok, 0) << degrees;
  }
}

TEST_F(AlignRefuses, ExtremeWarps) {
  const auto ok = [&](float a, float b, float c, float d) {
    Eigen::Matrix2f A;
    A << a, b, c, d;
    return image_.frame.align(patch_, A, {100, 80}, 5).ok;
  };
  EXPECT_FALSE(ok(0, 0, 0, 0));
  EXPECT_FALSE(ok(1, 0, 0, -1));       // mirrored
  EXPECT_FALSE(ok(1, 1, 1, 1));        // a line
  EXPECT_FALSE(ok(0.4F, 0, 0, 0.4F));  // would need a level finer than level 0
  EXPECT_FALSE(ok(20, 0, 0, 20));      // would need one far coarser than the last
  EXPECT_FALSE(ok(1, 0, 0, 0.3F));     // seen at a grazing angle: wider than the patch
  EXPECT_FALSE(ok(std::nanf(""), 0, 0, 1));
  Patch foreign = patch_;
  foreign.level = 20;  // from a pyramid of another depth
  EXPECT_FALSE(image_.frame.align(foreign, kIdentity, {100, 80}, 5).ok);
}

}  // namespace
}  // namespace farpoint::slam
