// SPDX-License-Identifier: Apache-2.0
// Every SIMD version of every kernel gives the bits of the plain version, and the plain version is what it
// says.
#include "slam/image/kernels.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "slam/image/descriptor_pattern.h"
#include "tests/image/test_images.h"

namespace farpoint::slam {
namespace {

using testing::OwnedImage;

// Textures of every kind: noise (all branches), rectangles (true corners), flat with few grey levels (ties).
std::vector<OwnedImage> images() {
  std::vector<OwnedImage> all = {testing::random_image(331, 64, 1), testing::rectangles(331, 64, 90, 2),
                                 testing::random_image(331, 64, 3)};
  for (std::uint8_t& p : all[2].pixels) p = static_cast<std::uint8_t>(p >= 128 ? 255 : (p >= 64 ? 10 : 0));
  return all;
}

// Runs `check` once with the kernels of every instruction set this machine has.
template <typename Check>
void for_each_target(const Check& check) {
  int tested = 0;
  for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1) {
    const std::int64_t target = targets & -targets;
    hwy::SetSupportedTargetsForTest(target);
    const Kernels& kernels = simd_kernels();
    hwy::SetSupportedTargetsForTest(0);
    SCOPED_TRACE(kernels.name);
    check(kernels);
    ++tested;
  }
  EXPECT_GE(tested, 1);
}

TEST(Kernels, PinningChoosesAndRefuses) {
  EXPECT_FALSE(pin_kernels("no such target"));
  EXPECT_STREQ(active_kernels().name, simd_kernels().name);
  ASSERT_TRUE(pin_kernels("plain"));
  EXPECT_STREQ(active_kernels().name, "plain");
  for_each_target([](const Kernels& kernels) {
    ASSERT_TRUE(pin_kernels(kernels.name));
    EXPECT_STREQ(active_kernels().name, kernels.name);
  });
  ASSERT_TRUE(pin_kernels("auto"));
  EXPECT_STREQ(active_kernels().name, simd_kernels().name);
}

TEST(Kernels, RowFiltersAreBitIdentical) {
  std::mt19937_64 rng(7);
  for (const OwnedImage& image : images()) {
    const std::uint8_t* row = image.pixels.data() + 5 * image.width;
    std::vector<ResampleBlock> blocks;
    for (int b = 0; b < 20; ++b) {
      ResampleBlock& block = blocks.emplace_back();
      block.first = static_cast<std::int32_t>(rng() % 200);
      for (int i = 0; i < ResampleBlock::kBlock; ++i) {
        const int w0 = static_cast<int>(rng() % 64), w1 = static_cast<int>(rng() % 64);
        const int weights[3] = {w0, w1, 128 - w0 - w1};
        for (int k = 0; k < 3; ++k) {
          block.shuffle[k][2 * i] = static_cast<std::uint8_t>(rng() % ResampleBlock::kWindow);
          block.shuffle[k][2 * i + 1] = 0x80;
          block.weight[k][i] = static_cast<std::int16_t>(weights[k]);
        }
      }
    }
    std::vector<std::int16_t> expected(512), actual(512);
    for (const int width : {1, 8, 31, 157}) {
      plain_kernels().resample_row(row, blocks.data(), width, expected.data());
      for_each_target([&](const Kernels& kernels) {
        kernels.resample_row(row, blocks.data(), width, actual.data());
        EXPECT_TRUE(std::equal(expected.begin(), expected.begin() + width, actual.begin())) << width;
      });
      std::vector<std::uint8_t> expected_blur(512), blur(512);
      plain_kernels().blur_row(row, width, expected_blur.data());
      for_each_target([&](const Kernels& kernels) {
        kernels.blur_row(row, width, blur.data());
        EXPECT_TRUE(std::equal(blur.begin(), blur.begin() + width, expected_blur.begin())) << width;
      });
    }
  }
}

TEST(Kernels, ColumnFiltersAreBitIdentical) {
  std::mt19937_64 rng(11);
  std::vector<std::vector<std::int16_t>> q7(3, std::vector<std::int16_t>(320));
  for (auto& row : q7) {
    for (auto& v : row) v = static_cast<std::int16_t>(rng() % 32641);
    for (std::size_t i = 0; i < 50; ++i) row[i] = i % 2 == 0 ? 32640 : 0;  // the extremes
  }
  const std::int16_t* const rows3[3] = {q7[0].data(), q7[1].data(), q7[2].data()};
  const OwnedImage pixels = testing::random_image(384, 7, 12);
  const std::uint8_t* rows7[7];
  for (int k = 0; k < 7; ++k) rows7[k] = pixels.pixels.data() + k * 384;
  std::vector<std::uint8_t> expected(320), actual(320);
  for (const int width : {1, 16, 77, 300}) {
    for (const auto& w :
         {std::array<std::int16_t, 3>{4096, 24576, 4096}, std::array<std::int16_t, 3>{0, 16384, 16384},
          std::array<std::int16_t, 3>{9321, 21001, 2446}}) {
      plain_kernels().combine_rows(rows3, w.data(), width, expected.data());
      EXPECT_EQ(expected[0], 255);
      for_each_target([&](const Kernels& kernels) {
        kernels.combine_rows(rows3, w.data(), width, actual.data());
        EXPECT_TRUE(std::equal(expected.begin(), expected.begin() + width, actual.begin())) << width;
      });
    }
    plain_kernels().blur_column(rows7, width, expected.data());
    for_each_target([&](const Kernels& kernels) {
      kernels.blur_column(rows7, width, actual.data());
      EXPECT_TRUE(std::equal(expected.begin(), expected.begin() + width, actual.begin())) << width;
    });
  }
}

TEST(Kernels, FastAndMaximaAreBitIdentical) {
  for (const OwnedImage& image : images()) {
    for (const int threshold : {1, 7, 20, 120, 254}) {
      for (const int end : {4, 12, 40, 100, 328}) {
        const int begin = 3;
        std::vector<std::vector<std::uint8_t>> expected(3, std::vector<std::uint8_t>(400, 0)),
            actual = expected;
        std::array<bool, 3> any{};
        for (std::size_t r = 0; r < 3; ++r) {
          const std::uint8_t* row = image.pixels.data() + (20 + static_cast<int>(r)) * image.width;
          any[r] =
              plain_kernels().fast_score_row(row, image.width, begin, end, threshold, expected[r].data());
        }
        std::vector<std::uint16_t> maxima(400), maxima_actual(400);
        const int count = plain_kernels().maxima_row(expected[0].data(), expected[1].data(),
                                                     expected[2].data(), begin, end, maxima.data());
        for_each_target([&](const Kernels& kernels) {
          for (std::size_t r = 0; r < 3; ++r) {
            const std::uint8_t* row = image.pixels.data() + (20 + static_cast<int>(r)) * image.width;
            std::fill(actual[r].begin(), actual[r].end(), std::uint8_t{0});
            EXPECT_EQ(kernels.fast_score_row(row, image.width, begin, end, threshold, actual[r].data()),
                      any[r]);
            EXPECT_EQ(expected[r], actual[r]);  // nothing outside [begin, end) is written either
          }
          ASSERT_EQ(kernels.maxima_row(expected[0].data(), expected[1].data(), expected[2].data(), begin, end,
                                       maxima_actual.data()),
                    count);
          EXPECT_TRUE(std::equal(maxima.begin(), maxima.begin() + count, maxima_actual.begin()));
        });
      }
    }
  }
}

TEST(Kernels, CentroidAndComparisonsAreBitIdentical) {
  const SteeredPattern pattern;
  std::vector<OwnedImage> all = images();
  all.emplace_back(331, 64, 255);
  for (const OwnedImage& image : all) {
    for (int x = 20; x < 300; x += 13) {
      const std::uint8_t* centre = image.pixels.data() + 31 * image.width + x;
      const CentroidMoments expected = plain_kernels().centroid(centre, image.width);
      const std::uint16_t* offsets = pattern.offsets(static_cast<float>(x) * 0.02F - 3.1F);
      std::array<std::uint64_t, 4> bits{};
      plain_kernels().compare_pairs(image.pixels.data() + x, offsets, bits.data());
      for_each_target([&](const Kernels& kernels) {
        const CentroidMoments actual = kernels.centroid(centre, image.width);
        EXPECT_EQ(actual.m10, expected.m10);
        EXPECT_EQ(actual.m01, expected.m01);
        std::array<std::uint64_t, 4> actual_bits{};
        kernels.compare_pairs(image.pixels.data() + x, offsets, actual_bits.data());
        EXPECT_EQ(actual_bits, bits);
      });
    }
  }
}

// The blur is what its weights say, up to the rounding of its averages.
TEST(Kernels, BlurHasItsWeights) {
  const OwnedImage image = testing::random_image(200, 1, 9);
  constexpr int kWeights[7] = {1, 2, 3, 4, 3, 2, 1};
  std::vector<std::uint8_t> out(256);
  plain_kernels().blur_row(&image.pixels[3], 128, out.data());
  for (int x = 0; x < 128; ++x) {
    double expected = 0;
    for (int k = 0; k < 7; ++k) expected += kWeights[k] * image.at(x + k, 0) / 16.0;
    EXPECT_GE(out[static_cast<std::size_t>(x)], expected - 0.01);
    EXPECT_LE(out[static_cast<std::size_t>(x)], expected + 2.0);  // four averages, each rounded up
  }
}

// FAST as its paper defines it, for one threshold.
bool is_fast_corner(const OwnedImage& image, int x, int y, int threshold) {
  constexpr int kX[16] = {0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
  constexpr int kY[16] = {-3, -3, -2, -1, 0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3};
  const int centre = image.at(x, y);
  int bright = 0, dark = 0;
  for (int i = 0; i < 16 + 8; ++i) {
    const int v = image.at(x + kX[i % 16], y + kY[i % 16]);
    bright = v > centre + threshold ? bright + 1 : 0;
    dark = v < centre - threshold ? dark + 1 : 0;
    if (bright >= 9 || dark >= 9) return true;
  }
  return false;
}

TEST(Kernels, FastScoreIsTheLargestThresholdThatPasses) {
  int corners = 0;
  for (const OwnedImage& image : images()) {
    for (int y = 10; y < 20; ++y) {
      std::vector<std::uint8_t> score(400, 0);
      simd_kernels().fast_score_row(image.pixels.data() + y * image.width, image.width, 3, 328, 5,
                                    score.data());
      for (int x = 3; x < 328; ++x) {
        const int s = score[static_cast<std::size_t>(x)];
        if (s == 0) {
          ASSERT_FALSE(is_fast_corner(image, x, y, 5)) << x << " " << y;
        } else {
          ASSERT_GE(s, 5);
          ASSERT_TRUE(is_fast_corner(image, x, y, s)) << x << " " << y;
          ASSERT_FALSE(is_fast_corner(image, x, y, s + 1)) << x << " " << y;
          ++corners;
        }
      }
    }
  }
  EXPECT_GT(corners, 300);
}

// Each connected maximum is kept once: no two survivors touch, and whatever was dropped has a neighbour at
// least as strong.
TEST(Kernels, MaximaAreNeitherDoubledNorLost) {
  std::mt19937_64 rng(23);
  constexpr int kWidth = 120, kHeight = 40;
  // Whole vectors are read, past the end of a row.
  std::vector<std::vector<std::uint8_t>> score(kHeight, std::vector<std::uint8_t>(kWidth + kRowAlignment, 0));
  for (int y = 1; y < kHeight - 1; ++y) {
    for (int x = 1; x < kWidth - 1; ++x) {
      if (rng() % 3 == 0)
        score[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)] =
            static_cast<std::uint8_t>(1 + rng() % 4);
    }
  }
  std::vector<std::vector<bool>> kept(kHeight, std::vector<bool>(kWidth, false));
  std::vector<std::uint16_t> out(kWidth);
  for (std::size_t y = 1; y + 1 < kHeight; ++y) {
    const int n = simd_kernels().maxima_row(score[y - 1].data(), score[y].data(), score[y + 1].data(), 1,
                                            kWidth - 1, out.data());
    for (int i = 0; i < n; ++i) kept[y][out[static_cast<std::size_t>(i)]] = true;
  }
  int survivors = 0;
  for (std::size_t y = 1; y + 1 < kHeight; ++y) {
    for (std::size_t x = 1; x + 1 < kWidth; ++x) {
      if (score[y][x] == 0) {
        ASSERT_FALSE(kept[y][x]);
        continue;
      }
      bool touches_survivor = false, has_rival = false;
      for (std::size_t j = y - 1; j <= y + 1; ++j) {
        for (std::size_t i = x - 1; i <= x + 1; ++i) {
          if (i == x && j == y) continue;
          touches_survivor |= kept[j][i];
          has_rival |= score[j][i] >= score[y][x];
        }
      }
      if (kept[y][x]) {
        ++survivors;
        ASSERT_FALSE(touches_survivor);
      } else {
        ASSERT_TRUE(has_rival);
      }
    }
  }
  EXPECT_GT(survivors, 100);
}

float uniform(std::mt19937_64& rng, float low, float high) {
  return std::uniform_real_distribution<float>(low, high)(rng);
}

TEST(Kernels, HammingDistancesAreExact) {
  std::mt19937_64 rng(31);
  constexpr std::size_t kDescriptors = 100;
  std::vector<Descriptor> descriptors(kDescriptors);
  for (Descriptor& d : descriptors)
    for (std::uint64_t& word : d.words) word = rng();
  descriptors[3].words = {};
  descriptors[4].words.fill(~std::uint64_t{0});
  std::vector<std::uint32_t> indices{3, 4};
  while (indices.size() < 67) indices.push_back(static_cast<std::uint32_t>(rng() % kDescriptors));
  for (const std::size_t query : {std::size_t{0}, std::size_t{3}, std::size_t{4}}) {
    const auto check = [&](const Kernels& kernels) {
      for (const std::size_t count : {std::size_t{0}, std::size_t{1}, indices.size()}) {
        std::vector<std::uint16_t> distances(indices.size() + 1, 999);
        kernels.hamming(descriptors[query].words.data(), descriptors[0].words.data(), indices.data(),
                        static_cast<int>(count), distances.data());
        for (std::size_t i = 0; i < count; ++i)
          EXPECT_EQ(distances[i], hamming_distance(descriptors[query], descriptors[indices[i]]));
        EXPECT_EQ(distances[count], 999) << "nothing is written behind the end";
      }
    };
    for_each_target(check);
    check(plain_kernels());
  }
  std::uint16_t opposite = 0;
  const std::uint32_t other = 4;
  plain_kernels().hamming(descriptors[3].words.data(), descriptors[0].words.data(), &other, 1, &opposite);
  EXPECT_EQ(opposite, 256);
}

TEST(Kernels, NearWordsAreIdenticalAndRight) {
  std::mt19937_64 rng(41);
  constexpr std::size_t kWords = 203, kReadBehind = 16;
  std::vector<std::uint64_t> words(kWords + kReadBehind);
  const std::uint64_t query = rng();
  for (std::uint64_t& word : words) {
    const std::uint64_t some = rng(), others = rng();
    word = query ^ (some & others);  // a quarter of the bits differ
  }
  words[0] = query;
  words[kWords - 1] = ~query;
  words[kWords] = query;  // behind the end
  for (const int max_bits : {0, 12, 16, 64}) {
    for (const std::size_t count :
         {std::size_t{0}, std::size_t{1}, std::size_t{15}, std::size_t{16}, kWords}) {
      std::vector<std::uint32_t> expected;
      for (std::uint32_t i = 0; i < count; ++i)
        if (std::popcount(query ^ words[i]) <= max_bits) expected.push_back(i);
      const auto check = [&](const Kernels& kernels) {
        std::vector<std::uint32_t> actual(kWords + 1, 999);
        const int n =
            kernels.near_words(query, words.data(), static_cast<int>(count), max_bits, actual.data());
        EXPECT_EQ(actual[static_cast<std::size_t>(n)], 999U) << "nothing is written behind the end";
        actual.resize(static_cast<std::size_t>(n));
        EXPECT_EQ(actual, expected) << kernels.name << ' ' << max_bits << ' ' << count;
      };
      for_each_target(check);
      check(plain_kernels());
    }
  }
}

TEST(Kernels, BandSelectionIsIdenticalAndRight) {
  std::mt19937_64 rng(37);
  constexpr std::size_t kPoints = 500;
  std::vector<float> u, v, angle, level;
  for (std::size_t i = 0; i < kPoints + kRowAlignment; ++i) {
    u.push_back(uniform(rng, 0, 200));
    v.push_back(uniform(rng, 0, 100));
    angle.push_back(uniform(rng, -3.1415F, 3.1415F));
    level.push_back(static_cast<float>(rng() % 8));
  }
  const PointArrays points{u.data(), v.data(), angle.data(), level.data()};
  std::size_t selected = 0;
  for (int trial = 0; trial < 800; ++trial) {
    Band band;
    const float direction = uniform(rng, -3.1415F, 3.1415F);
    band.u_px = uniform(rng, 0, 200);
    band.v_px = uniform(rng, 0, 100);
    band.along_u = std::cos(direction);
    band.along_v = std::sin(direction);
    band.length_px = uniform(rng, 0, 150);
    band.half_width_px = uniform(rng, 1, 20);
    band.min_level = static_cast<float>(rng() % 4);
    band.max_level = band.min_level + 3;
    band.angle_rad = uniform(rng, -3.1415F, 3.1415F);
    band.max_turn_rad = 1.0F;
    // Ranges apart, adjacent and empty.
    const int begin = static_cast<int>(rng() % 50), gap = begin + static_cast<int>(rng() % 200);
    const int gap_end = gap + static_cast<int>(rng() % 3), end = gap_end + static_cast<int>(rng() % 200);
    const std::array<PositionRange, 3> ranges{{{begin, gap}, {gap, gap}, {gap_end, end}}};
    std::vector<std::uint32_t> expected(kPoints), actual(kPoints);
    const int count = plain_kernels().select_in_band(points, ranges.data(), 3, band, expected.data());
    expected.resize(static_cast<std::size_t>(count));
    for_each_target([&](const Kernels& kernels) {
      actual.assign(kPoints, 0);
      const int n = kernels.select_in_band(points, ranges.data(), 3, band, actual.data());
      actual.resize(static_cast<std::size_t>(n));
      EXPECT_EQ(actual, expected);
    });
    selected += expected.size();
    // Against the definition, where rounding cannot decide otherwise.
    for (int i = begin; i < end; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const double x = u[k] - band.u_px, y = v[k] - band.v_px;
      const double along = x * std::cos(double{direction}) + y * std::sin(double{direction});
      const double across = std::abs(y * std::cos(double{direction}) - x * std::sin(double{direction}));
      const double turn = std::abs(std::remainder(double{angle[k]} - double{band.angle_rad}, 6.283185307));
      const double worst = std::max({across - double{band.half_width_px}, -along - double{band.half_width_px},
                                     along - double{band.length_px} - double{band.half_width_px},
                                     turn - double{band.max_turn_rad}});
      if (std::abs(worst) < 1e-3) continue;
      const bool asked = i < gap || i >= gap_end;
      const bool inside = asked && worst < 0 && level[k] >= band.min_level && level[k] <= band.max_level;
      EXPECT_EQ(std::count(expected.begin(), expected.end(), static_cast<std::uint32_t>(i)), inside ? 1 : 0);
    }
  }
  EXPECT_GT(selected, 1000U);
}

TEST(Kernels, SmoothedPatchesAreBitIdentical) {
  std::mt19937_64 rng(41);
  std::array<std::uint8_t, kAlignPatchSide * kAlignPatchSide> patch{};
  for (std::uint8_t& p : patch) p = static_cast<std::uint8_t>(rng());
  std::array<float, patch.size()> expected{}, actual{};
  plain_kernels().smooth_patch(patch.data(), expected.data());
  for_each_target([&](const Kernels& kernels) {
    kernels.smooth_patch(patch.data(), actual.data());
    EXPECT_EQ(actual, expected);
  });
  patch.fill(200);
  simd_kernels().smooth_patch(patch.data(), actual.data());
  for (const float v : actual) EXPECT_EQ(v, 200.0F);
}

TEST(Kernels, SampledPatchesAreBitIdenticalAndFollowAPlane) {
  std::mt19937_64 rng(43);
  std::array<float, kAlignPatchSide * kAlignPatchSide> noise{}, plane{};
  for (int y = 0; y < kAlignPatchSide; ++y)
    for (int x = 0; x < kAlignPatchSide; ++x) {
      const auto at = static_cast<std::size_t>(y) * kAlignPatchSide + static_cast<std::size_t>(x);
      noise[at] = uniform(rng, 0, 255);
      plane[at] = static_cast<float>(10 + 3 * x - 2 * y);
    }
  for (int trial = 0; trial < 50; ++trial) {
    PatchSampling s;
    s.xi = uniform(rng, 0.5F, 1.2F);
    s.yj = uniform(rng, 0.5F, 1.2F);
    s.xj = uniform(rng, -0.4F, 0.4F);
    s.yi = uniform(rng, -0.4F, 0.4F);
    s.x0 = 8 - 3.5F * (s.xi + s.xj);
    s.y0 = 8 - 3.5F * (s.yi + s.yj);
    s.share = 0.25F;
    PatchTemplate expected{}, on_plane{};
    plain_kernels().sample_patch(noise.data(), s, &expected);
    plain_kernels().sample_patch(noise.data(), s, &expected);  // adds
    for_each_target([&](const Kernels& kernels) {
      PatchTemplate actual{};
      kernels.sample_patch(noise.data(), s, &actual);
      kernels.sample_patch(noise.data(), s, &actual);
      EXPECT_TRUE(std::equal(expected.value, expected.value + kTemplateCount, actual.value));
      EXPECT_TRUE(std::equal(expected.dx, expected.dx + kTemplateCount, actual.dx));
      EXPECT_TRUE(std::equal(expected.dy, expected.dy + kTemplateCount, actual.dy));
    });
    s.share = 1;
    simd_kernels().sample_patch(plane.data(), s, &on_plane);
    for (int at = 0; at < kTemplateCount; ++at) {
      const int column = at % kTemplateSide, row = at / kTemplateSide;
      const auto i = static_cast<float>(column), j = static_cast<float>(row);
      const float x = s.x0 + s.xi * i + s.xj * j, y = s.y0 + s.yi * i + s.yj * j;
      EXPECT_NEAR(on_plane.value[at], 10 + 3 * x - 2 * y, 1e-3F);
      EXPECT_NEAR(on_plane.dx[at], 3 * s.xi - 2 * s.yi, 1e-4F);
      EXPECT_NEAR(on_plane.dy[at], 3 * s.xj - 2 * s.yj, 1e-4F);
    }
  }
}

TEST(Kernels, WindowSumsAreBitIdenticalAndRight) {
  std::mt19937_64 rng(47);
  const OwnedImage image = testing::random_image(331, 64, 5);
  for (int trial = 0; trial < 50; ++trial) {
    PatchTemplate with{};
    for (int at = 0; at < kTemplateCount; ++at) {
      with.value[at] = uniform(rng, -1, 1);
      with.dx[at] = uniform(rng, -1, 1);
      with.dy[at] = uniform(rng, -1, 1);
    }
    float wx[5], wy[5];
    for (int k = 0; k < 5; ++k) wx[k] = uniform(rng, 0, 0.4F), wy[k] = uniform(rng, 0, 0.4F);
    const int x = static_cast<int>(rng() % 319), y = static_cast<int>(rng() % 52);
    const std::uint8_t* corner = image.pixels.data() + y * image.width + x;
    const WindowSums expected = plain_kernels().window_sums(corner, image.width, wx, wy, with);
    for_each_target([&](const Kernels& kernels) {
      const WindowSums actual = kernels.window_sums(corner, image.width, wx, wy, with);
      EXPECT_EQ(actual.value, expected.value);
      EXPECT_EQ(actual.square, expected.square);
      EXPECT_EQ(actual.along, expected.along);
      EXPECT_EQ(actual.dx, expected.dx);
      EXPECT_EQ(actual.dy, expected.dy);
    });
    double window[kTemplateCount], sum = 0, square = 0, along = 0;
    for (int at = 0; at < kTemplateCount; ++at) {
      window[at] = 0;
      for (int j = 0; j < 5; ++j)
        for (int i = 0; i < 5; ++i)
          window[at] += double{wx[i]} * double{wy[j]} *
                        image.at(x + at % kTemplateSide + i, y + at / kTemplateSide + j);
    }
    for (int at = 0; at < kTemplateCount; ++at) {
      const double value = window[at] - window[kTemplateCount / 2];
      sum += value;
      square += value * value;
      along += value * double{with.value[at]};
    }
    EXPECT_NEAR(expected.value, sum, 1e-5 * (1 + std::sqrt(square)) * 8);
    EXPECT_NEAR(expected.square, square, 1e-4 * (1 + square));
    EXPECT_NEAR(expected.along, along, 1e-5 * (1 + std::sqrt(square)) * 8);
  }
}

}  // namespace
}  // namespace farpoint::slam
