// The definition of every kernel, without any cleverness. The Highway versions must give the same bits.
#include <algorithm>

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

constexpr Kernels kPlain = {"plain",        resample_row, combine_rows, blur_row,     blur_column,
                            fast_score_row, maxima_row,   centroid,     compare_pairs};

}  // namespace

const Kernels& plain_kernels() {
  return kPlain;
}

}  // namespace farpoint::slam
