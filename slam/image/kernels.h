// SPDX-License-Identifier: Apache-2.0
// The inner loops of image processing, as a table of functions: a plain C++ version, which is the definition
// and the reference of the tests, and Highway versions for every instruction set, chosen at run time. All
// arithmetic is integer, or float in one fixed order of operations. Every version gives the same
// bits.
#pragma once

#include <cstddef>
#include <cstdint>

namespace farpoint::slam {

// One output pixel of a resampled row is the sum of three neighbouring source pixels. Blocks of kBlock
// outputs read one window of 16 source bytes, so that SIMD needs one load and three shuffles a block.
struct ResampleBlock {
  static constexpr int kBlock = 8;
  static constexpr int kWindow = 16;
  std::int16_t weight[3][kBlock] = {};  // Q7, the three sum to 128
  // Shuffle that widens the tap's bytes to 16 bits: byte 2 i is the position within the window, byte 2 i + 1
  // is 0x80.
  std::uint8_t shuffle[3][2 * kBlock] = {};
  std::int32_t first = 0;  // first source byte of the window
};

// Most elements of one vector. A row that a kernel fills has room for its width rounded up to a multiple of
// this. resample_row may read as many bytes behind the last source
// pixel.
inline constexpr int kRowAlignment = 64;

// A descriptor and an orientation read a square of this side around the corner, corner at (kRadius, kRadius).
inline constexpr int kPatchRadiusPx = 15;
inline constexpr int kPatchSidePx = 2 * kPatchRadiusPx + 1;
// Side of the compact copy that descriptor offsets refer to: offset = (y + 15) * 32 + (x + 15).
inline constexpr int kPatchStrideBytes = 32;
// Half-width of the disc of the intensity centroid at row distance 0..15: floor(sqrt(15.5^2 - y^2)), at
// most 15.
inline constexpr int kDiscHalfWidthPx[kPatchRadiusPx + 1] = {15, 15, 15, 15, 14, 14, 14, 13,
                                                             13, 12, 11, 10, 9,  8,  6,  3};

struct CentroidMoments {
  std::int32_t m10 = 0;  // sum of x * intensity over the disc
  std::int32_t m01 = 0;  // sum of y * intensity
};

// Points in an image, one array a coordinate. Up to kRowAlignment elements behind the last are read.
struct PointArrays {
  const float* u_px = nullptr;
  const float* v_px = nullptr;
  const float* angle_rad = nullptr;  // -pi..pi
  const float* level = nullptr;
};

// The surroundings of a line segment, and the limits of level and angle for a point in it.
struct Band {
  float u_px = 0, v_px = 0;               // where the segment begins
  float along_u = 1, along_v = 0;         // its direction, unit
  float length_px = 0;                    // of the segment
  float half_width_px = 0;                // to each side, and beyond each end
  float min_level = 0, max_level = 0;     // inclusive
  float angle_rad = 0, max_turn_rad = 0;  // largest difference of angles, 0..pi
};

// Positions [begin, end) of PointArrays.
struct PositionRange {
  std::int32_t begin = 0, end = 0;
};

// Patch alignment (alignment.cc): side of a patch, and of the template that is warped from it.
inline constexpr int kAlignPatchSide = 16;
inline constexpr int kTemplateSide = 8;
inline constexpr int kTemplateCount = kTemplateSide * kTemplateSide;

// Template pixel (i, j), i along the row, reads the patch at (x0 + xi i + xj j, y0 + yi i + yj j), which must
// lie in 0.5 .. 14.5.
struct PatchSampling {
  float x0 = 0, xi = 1, xj = 0;
  float y0 = 0, yi = 0, yj = 1;
  float share = 1;  // of this sample in the template pixel's mean
};

// A patch as seen from the target level: values, and derivatives by the target's pixel.
struct PatchTemplate {
  alignas(64) float value[kTemplateCount], dx[kTemplateCount], dy[kTemplateCount];
};

// Sums over a window w of an image, about one of its pixels: v = w - w[32].
struct WindowSums {
  float value = 0, square = 0;      // of v, v v
  float along = 0, dx = 0, dy = 0;  // of v times the template's arrays
};

struct Kernels {
  const char* name;

  // Row resampling: out[x] = sum of three taps, Q7 (0..32640). `blocks` cover `width` rounded up to whole
  // blocks.
  void (*resample_row)(const std::uint8_t* source, const ResampleBlock* blocks, int width, std::int16_t* out);
  // Column resampling: out[x] = round(sum of rows * weights), weights Q15 summing to 32768, rows Q7.
  void (*combine_rows)(const std::int16_t* const rows[3], const std::int16_t weights[3], int width,
                       std::uint8_t* out);

  // Blur with (1 2 3 4 3 2 1) / 16 (variance 2.5 px^2), made of rounded averages of two: avg(a, b) = (a + b +
  // 1) / 2, fine(x) = avg(avg(p[x-1], p[x+1]), p[x]), out(x) = avg(avg(fine(x-2), fine(x+2)), fine(x)).
  // blur_row needs three pixels on both sides of source[0..width) rounded up to kRowAlignment; the caller
  // chooses their values at the edges. blur_column does the same over seven rows.
  void (*blur_row)(const std::uint8_t* source, int width, std::uint8_t* out);
  void (*blur_column)(const std::uint8_t* const rows[7], int width, std::uint8_t* out);

  // FAST-9/16: score[x] = the largest threshold t at which nine contiguous of the sixteen pixels on the
  // circle of radius 3 are all brighter than centre + t or all darker than centre - t; 0 where that is below
  // `threshold` (>= 1). x in [begin, end); three pixels around must exist,
  // and kRowAlignment readable bytes behind them. Returns false if all scores are 0.
  bool (*fast_score_row)(const std::uint8_t* centre_row, std::ptrdiff_t stride, int begin, int end,
                         int threshold, std::uint8_t* score);
  // Positions of [begin, end) whose score is positive and a maximum of its 3x3 neighbourhood; of equal
  // neighbours the last in raster order wins. Columns begin-1 and end count, up to
  // kRowAlignment behind are read. Returns how many were written
  // to `out`.
  int (*maxima_row)(const std::uint8_t* above, const std::uint8_t* here, const std::uint8_t* below, int begin,
                    int end, std::uint16_t* out);

  // First moments of the disc of radius 15 around `centre`. Sixteen pixels to each side are read.
  CentroidMoments (*centroid)(const std::uint8_t* centre, std::ptrdiff_t stride);
  // Bit i of the result: patch[offsets[2 i]] < patch[offsets[2 i + 1]], for i < 256.
  void (*compare_pairs)(const std::uint8_t* patch, const std::uint16_t* offsets, std::uint64_t bits[4]);

  // distances[i] = number of bits in which `query` and the 256 bits at descriptors + 4 * indices[i] differ.
  void (*hamming)(const std::uint64_t query[4], const std::uint64_t* descriptors,
                  const std::uint32_t* indices, int count, std::uint16_t* distances);
  // Positions of [0, count) whose word differs from `query` in at most `max_bits` bits, ascending. Sixteen
  // words behind the last are read. Returns how many were written to `out`.
  int (*near_words)(std::uint64_t query, const std::uint64_t* words, int count, int max_bits,
                    std::uint32_t* out);
  // Positions of the ranges that lie in the band, range by range, ascending. Returns how many were written to
  // `out`.
  int (*select_in_band)(const PointArrays& points, const PositionRange* ranges, int range_count,
                        const Band& band, std::uint32_t* out);

  // [1 2 1] / 4 along both axes of a 16x16 patch; pixels outside count as their neighbour inside.
  void (*smooth_patch)(const std::uint8_t* patch, float* out);
  // Adds `share` of the quadratic B-spline of the smoothed patch at the sampling's positions, and of its
  // derivatives by (i, j), to the template.
  void (*sample_patch)(const float* smooth, const PatchSampling& sampling, PatchTemplate* out);
  // The 8x8 window of an image that has the weights wx over five columns and wy over five rows; `corner` is
  // the first of 12x12 pixels. Floats are summed in eight partial sums,
  // one a column, each from the top, and these pairwise: every version gives the same bits.
  WindowSums (*window_sums)(const std::uint8_t* corner, std::ptrdiff_t stride, const float wx[5],
                            const float wy[5], const PatchTemplate& with);
};

[[nodiscard]] const Kernels& plain_kernels();
// The best of this machine, or what Highway's SetSupportedTargetsForTest left of it.
[[nodiscard]] const Kernels& simd_kernels();
// What Pyramid and Extractor use: simd_kernels() unless pinned.
[[nodiscard]] const Kernels& active_kernels();
// Pins active_kernels() to "plain", "auto", or a Highway target name ("SSE4", "AVX2", "NEON", ...; see
// hwy::TargetName) for the rest of the process. False, and nothing changes, if this machine has no such
// target.
bool pin_kernels(const char* name);

}  // namespace farpoint::slam
