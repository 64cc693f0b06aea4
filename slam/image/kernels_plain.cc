// SPDX-License-Identifier: Apache-2.0
// The definition of every kernel, without any cleverness. The Highway versions must give the same bits.
#include <algorithm>
#include <bit>
#include <cmath>

#include "slam/image/kernels.h"

namespace farpoint::slam {
namespace {

void resample_row(const std::uint8_t* source, const ResampleBlock* blocks, int width, std::int16_t* out) {
  for (int x = 0; x < width; ++x) {
    const ResampleBlock& block = blocks[x / ResampleBlock::kBlock];
    const int i = x % ResampleBlock::kBlock;
    int sum = 0;
    for (int k = 0; k < 3; ++k) sum += source[block.first + block.shuffle[k][2 * i]] * block.weight[k][i];
    out[x] = static_cast<std::int16_t>(sum);
  }
}

// Rounded product of two Q15 numbers: one instruction on x86 (pmulhrsw) and Arm (sqrdmulh).
int multiply_q15(int a, int b) {
  return (a * b + (1 << 14)) >> 15;
}

void combine_rows(const std::int16_t* const rows[3], const std::int16_t weights[3], int width,
                  std::uint8_t* out) {
  for (int x = 0; x < width; ++x) {
    int sum = 0;
    for (int k = 0; k < 3; ++k) sum += multiply_q15(rows[k][x], weights[k]);
    out[x] = static_cast<std::uint8_t>(std::clamp((sum + 64) >> 7, 0, 255));
  }
}

std::uint8_t average(int a, int b) {
  return static_cast<std::uint8_t>((a + b + 1) / 2);
}

// p[0..6] are seven pixels in a line.
std::uint8_t blur(const std::uint8_t p[7]) {
  std::uint8_t fine[3];
  for (int i = 0; i < 3; ++i) fine[i] = average(average(p[2 * i], p[2 * i + 2]), p[2 * i + 1]);
  return average(average(fine[0], fine[2]), fine[1]);
}

void blur_row(const std::uint8_t* source, int width, std::uint8_t* out) {
  for (int x = 0; x < width; ++x) out[x] = blur(source + x - 3);
}

void blur_column(const std::uint8_t* const rows[7], int width, std::uint8_t* out) {
  for (int x = 0; x < width; ++x) {
    std::uint8_t column[7];
    for (int k = 0; k < 7; ++k) column[k] = rows[k][x];
    out[x] = blur(column);
  }
}

// The Bresenham circle of radius 3, clockwise from the top.
constexpr int kCircleX[16] = {0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
constexpr int kCircleY[16] = {-3, -3, -2, -1, 0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3};

// Largest threshold at which nine contiguous pixels are all brighter, or all darker; at most 0 if there is
// none.
int fast_score(const std::uint8_t* centre, std::ptrdiff_t stride) {
  int ring[16];
  for (int i = 0; i < 16; ++i) ring[i] = centre[kCircleY[i] * stride + kCircleX[i]];
  int best_bright = 0, best_dark = 255;
  for (int start = 0; start < 16; ++start) {
    int low = 255, high = 0;
    for (int k = 0; k < 9; ++k) {
      low = std::min(low, ring[(start + k) % 16]);
      high = std::max(high, ring[(start + k) % 16]);
    }
    best_bright = std::max(best_bright, low);
    best_dark = std::min(best_dark, high);
  }
  // "Brighter than centre + t" is strict, so the largest such t is one less than the difference.
  return std::max(best_bright - *centre, *centre - best_dark) - 1;
}

bool fast_score_row(const std::uint8_t* centre_row, std::ptrdiff_t stride, int begin, int end, int threshold,
                    std::uint8_t* score) {
  bool any = false;
  for (int x = begin; x < end; ++x) {
    const int s = fast_score(centre_row + x, stride);
    score[x] = static_cast<std::uint8_t>(s >= threshold ? s : 0);
    any |= score[x] != 0;
  }
  return any;
}

int maxima_row(const std::uint8_t* above, const std::uint8_t* here, const std::uint8_t* below, int begin,
               int end, std::uint16_t* out) {
  int count = 0;
  for (int x = begin; x < end; ++x) {
    const int s = here[x];
    if (s == 0) continue;
    const int before = std::max({above[x - 1], above[x], above[x + 1], here[x - 1]});
    const int after = std::max({here[x + 1], below[x - 1], below[x], below[x + 1]});
    if (s >= before && s > after) out[count++] = static_cast<std::uint16_t>(x);
  }
  return count;
}

CentroidMoments centroid(const std::uint8_t* centre, std::ptrdiff_t stride) {
  CentroidMoments m;
  for (int y = -kPatchRadiusPx; y <= kPatchRadiusPx; ++y) {
    const int half = kDiscHalfWidthPx[std::abs(y)];
    for (int x = -half; x <= half; ++x) {
      const int value = centre[y * stride + x];
      m.m10 += x * value;
      m.m01 += y * value;
    }
  }
  return m;
}

void compare_pairs(const std::uint8_t* patch, const std::uint16_t* offsets, std::uint64_t bits[4]) {
  for (int word = 0; word < 4; ++word) {
    std::uint64_t b = 0;
    for (int i = 0; i < 64; ++i, offsets += 2) {
      b |= static_cast<std::uint64_t>(patch[offsets[0]] < patch[offsets[1]]) << i;
    }
    bits[word] = b;
  }
}

void hamming(const std::uint64_t query[4], const std::uint64_t* descriptors, const std::uint32_t* indices,
             int count, std::uint16_t* distances) {
  for (int i = 0; i < count; ++i) {
    const std::uint64_t* other = descriptors + 4 * static_cast<std::size_t>(indices[i]);
    int sum = 0;
    for (int word = 0; word < 4; ++word) sum += std::popcount(query[word] ^ other[word]);
    distances[i] = static_cast<std::uint16_t>(sum);
  }
}

int near_words(std::uint64_t query, const std::uint64_t* words, int count, int max_bits, std::uint32_t* out) {
  int found = 0;
  for (int i = 0; i < count; ++i)
    if (std::popcount(query ^ words[i]) <= max_bits) out[found++] = static_cast<std::uint32_t>(i);
  return found;
}

bool in_band(const PointArrays& points, int i, const Band& band) {
  constexpr float kTurn = 6.2831853F;
  const float du = points.u_px[i] - band.u_px, dv = points.v_px[i] - band.v_px;
  const float along = du * band.along_u + dv * band.along_v;
  const float across = std::abs(dv * band.along_u - du * band.along_v);
  const float turn = std::abs(points.angle_rad[i] - band.angle_rad);
  return across <= band.half_width_px && along >= -band.half_width_px &&
         along <= band.length_px + band.half_width_px && std::min(turn, kTurn - turn) <= band.max_turn_rad &&
         points.level[i] >= band.min_level && points.level[i] <= band.max_level;
}

int select_in_band(const PointArrays& points, const PositionRange* ranges, int range_count, const Band& band,
                   std::uint32_t* out) {
  int count = 0;
  for (const PositionRange* r = ranges; r != ranges + range_count; ++r)
    for (int i = r->begin; i < r->end; ++i)
      if (in_band(points, i, band)) out[count++] = static_cast<std::uint32_t>(i);
  return count;
}

void smooth_patch(const std::uint8_t* patch, float* out) {
  constexpr int kSide = kAlignPatchSide;
  const auto inside = [](int i) { return std::clamp(i, 0, kSide - 1); };
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      int sum = 0;
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i)
          sum += (2 - std::abs(i)) * (2 - std::abs(j)) * patch[inside(y + j) * kSide + inside(x + i)];
      out[y * kSide + x] = static_cast<float>(sum) * 0.0625F;
    }
  }
}

// The quadratic B-spline: weights of the pixels nearest - 1, nearest, nearest + 1 at offset t from the
// nearest, |t| <= 0.5, and their derivatives.
struct SplineWeights {
  float weight[3], slope[3];
};
SplineWeights spline(float t) {
  const float half_square = 0.5F * (t * t), half = 0.5F * t;
  return {{(0.125F - half) + half_square, 0.75F - t * t, (0.125F + half) + half_square},
          {t - 0.5F, -2.0F * t, t + 0.5F}};
}

void sample_patch(const float* smooth, const PatchSampling& s, PatchTemplate* out) {
  for (int at = 0; at < kTemplateCount; ++at) {
    const int column = at % kTemplateSide, row = at / kTemplateSide;
    const auto i = static_cast<float>(column), j = static_cast<float>(row);
    const float x = (s.x0 + s.xj * j) + s.xi * i, y = (s.y0 + s.yj * j) + s.yi * i;
    const int nearest_x = static_cast<int>(std::floor(x + 0.5F)),
              nearest_y = static_cast<int>(std::floor(y + 0.5F));
    const SplineWeights wx = spline(x - static_cast<float>(nearest_x)),
                        wy = spline(y - static_cast<float>(nearest_y));
    const float* p = smooth + (nearest_y - 1) * kAlignPatchSide + nearest_x - 1;
    float across[3], down[3];  // of each column
    for (int k = 0; k < 3; ++k) {
      const float top = p[k], middle = p[k + kAlignPatchSide], bottom = p[k + 2 * kAlignPatchSide];
      across[k] = (wy.weight[0] * top + wy.weight[1] * middle) + wy.weight[2] * bottom;
      down[k] = (wy.slope[0] * top + wy.slope[1] * middle) + wy.slope[2] * bottom;
    }
    const auto mix = [](const float w[3], const float c[3]) {
      return (w[0] * c[0] + w[1] * c[1]) + w[2] * c[2];
    };
    const float slope_x = mix(wx.slope, across), slope_y = mix(wx.weight, down);
    out->value[at] += s.share * mix(wx.weight, across);
    out->dx[at] += s.share * (s.xi * slope_x + s.yi * slope_y);
    out->dy[at] += s.share * (s.xj * slope_x + s.yj * slope_y);
  }
}

float mix5(const float w[5], float a, float b, float c, float d, float e) {
  return (((w[0] * a + w[1] * b) + w[2] * c) + w[3] * d) + w[4] * e;
}

WindowSums window_sums(const std::uint8_t* corner, std::ptrdiff_t stride, const float wx[5],
                       const float wy[5], const PatchTemplate& with) {
  constexpr int kSide = kTemplateSide;
  float rows[kSide + 4][kSide], window[kTemplateCount];
  for (int r = 0; r < kSide + 4; ++r) {
    const std::uint8_t* p = corner + r * stride;
    for (int c = 0; c < kSide; ++c) rows[r][c] = mix5(wx, p[c], p[c + 1], p[c + 2], p[c + 3], p[c + 4]);
  }
  for (int r = 0; r < kSide; ++r)
    for (int c = 0; c < kSide; ++c)
      window[r * kSide + c] =
          mix5(wy, rows[r][c], rows[r + 1][c], rows[r + 2][c], rows[r + 3][c], rows[r + 4][c]);
  const float reference = window[kTemplateCount / 2];
  float sums[5][kSide] = {};
  for (int at = 0; at < kTemplateCount; ++at) {
    const float v = window[at] - reference;
    const int c = at % kSide;
    sums[0][c] += v;
    sums[1][c] += v * v;
    sums[2][c] += v * with.value[at];
    sums[3][c] += v * with.dx[at];
    sums[4][c] += v * with.dy[at];
  }
  const auto total = [](const float s[kSide]) {
    return ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
  };
  return {total(sums[0]), total(sums[1]), total(sums[2]), total(sums[3]), total(sums[4])};
}

constexpr Kernels kPlain = {"plain",        resample_row,   combine_rows, blur_row,      blur_column,
                            fast_score_row, maxima_row,     centroid,     compare_pairs, hamming,
                            near_words,     select_in_band, smooth_patch, sample_patch,  window_sums};

}  // namespace

const Kernels& plain_kernels() {
  return kPlain;
}

}  // namespace farpoint::slam
