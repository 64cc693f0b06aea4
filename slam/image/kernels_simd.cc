// SPDX-License-Identifier: Apache-2.0
// Highway versions of the kernels: compiled once for every instruction set, the best one is chosen at run
// time. The plain versions in kernels_plain.cc say what is computed; the comments here say only how.
#include <algorithm>

#include "slam/image/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "slam/image/kernels_simd.cc"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace farpoint::slam::HWY_NAMESPACE {
#if HWY_TARGET == HWY_SCALAR
// No vectors (x86 before SSSE3): the plain versions serve.
const Kernels* table() {
  return &plain_kernels();
}
#else
namespace hn = hwy::HWY_NAMESPACE;

// At most 64 lanes, so that mask bits fit one word and row padding has a bound.
using U8 = hn::CappedTag<std::uint8_t, kRowAlignment>;
using I16 = hn::CappedTag<std::int16_t, kRowAlignment / 2>;
using U8Half = hn::Rebind<std::uint8_t, I16>;  // as many lanes as I16

void resample_row(const std::uint8_t* HWY_RESTRICT source, const ResampleBlock* HWY_RESTRICT blocks,
                  int width, std::int16_t* HWY_RESTRICT out) {
  const hn::FixedTag<std::uint8_t, 16> d8;
  const hn::FixedTag<std::int16_t, 8> d16;
  for (int x = 0; x < width; x += ResampleBlock::kBlock, ++blocks) {
    const auto window = hn::LoadU(d8, source + blocks->first);
    const auto tap = [&](int k) HWY_ATTR {
      const auto pixels =
          hn::BitCast(d16, hn::TableLookupBytesOr0(window, hn::LoadU(d8, blocks->shuffle[k])));
      return hn::Mul(pixels, hn::LoadU(d16, blocks->weight[k]));
    };
    hn::StoreU(hn::Add(hn::Add(tap(0), tap(1)), tap(2)), d16, out + x);
  }
}

void combine_rows(const std::int16_t* const rows[3], const std::int16_t weights[3], int width,
                  std::uint8_t* HWY_RESTRICT out) {
  const I16 d;
  const U8Half d8;
  const auto w0 = hn::Set(d, weights[0]), w1 = hn::Set(d, weights[1]), w2 = hn::Set(d, weights[2]);
  const auto half = hn::Set(d, 64);
  const int step = static_cast<int>(hn::Lanes(d));
  for (int x = 0; x < width; x += step) {
    auto sum = hn::Add(half, hn::MulFixedPoint15(hn::LoadU(d, rows[0] + x), w0));
    sum = hn::Add(sum, hn::MulFixedPoint15(hn::LoadU(d, rows[1] + x), w1));
    sum = hn::Add(sum, hn::MulFixedPoint15(hn::LoadU(d, rows[2] + x), w2));
    hn::StoreU(hn::DemoteTo(d8, hn::ShiftRight<7>(sum)), d8, out + x);
  }
}

using V8 = hn::Vec<U8>;

// `at(k)` loads the pixels k steps from the centre, -3 <= k <= 3.
template <typename At>
HWY_INLINE V8 blur_vector(const At& at) {
  const auto fine = [&](int k)
                        HWY_ATTR { return hn::AverageRound(hn::AverageRound(at(k - 1), at(k + 1)), at(k)); };
  return hn::AverageRound(hn::AverageRound(fine(-2), fine(2)), fine(0));
}

void blur_row(const std::uint8_t* HWY_RESTRICT source, int width, std::uint8_t* HWY_RESTRICT out) {
  const U8 d;
  const int step = static_cast<int>(hn::Lanes(d));
  for (int x = 0; x < width; x += step) {
    hn::StoreU(blur_vector([&](int k) HWY_ATTR { return hn::LoadU(d, source + x + k); }), d, out + x);
  }
}

void blur_column(const std::uint8_t* const rows[7], int width, std::uint8_t* HWY_RESTRICT out) {
  const U8 d;
  const int step = static_cast<int>(hn::Lanes(d));
  for (int x = 0; x < width; x += step) {
    hn::StoreU(blur_vector([&](int k) HWY_ATTR { return hn::LoadU(d, rows[k + 3] + x); }), d, out + x);
  }
}

// Scores of one vector of centres. Arcs of nine that start at an even position and at the next one share
// eight pixels, so the best of both is min(shared, max(first, last)): half the work of sixteen arcs.
HWY_INLINE V8 fast_score_vector(U8 d, const std::uint8_t* HWY_RESTRICT c, std::ptrdiff_t s, V8 threshold) {
  const V8 centre = hn::LoadU(d, c);
  const V8 p0 = hn::LoadU(d, c - 3 * s), p4 = hn::LoadU(d, c + 3), p8 = hn::LoadU(d, c + 3 * s),
           p12 = hn::LoadU(d, c - 3);
  // Nine contiguous pixels hold one of each opposite pair: a bound that most of an image fails.
  const V8 bright_bound = hn::Min(hn::Max(p0, p8), hn::Max(p4, p12));
  const V8 dark_bound = hn::Max(hn::Min(p0, p8), hn::Min(p4, p12));
  const V8 bound = hn::Max(hn::SaturatedSub(bright_bound, centre), hn::SaturatedSub(centre, dark_bound));
  const V8 zero = hn::Zero(d);
  if (hn::AllTrue(d, hn::Eq(hn::SaturatedSub(bound, threshold), zero))) return zero;

  const V8 p2 = hn::LoadU(d, c - 2 * s + 2), p6 = hn::LoadU(d, c + 2 * s + 2),
           p10 = hn::LoadU(d, c + 2 * s - 2), p14 = hn::LoadU(d, c - 2 * s - 2);
  const V8 bright_bound2 = hn::Min(bright_bound, hn::Min(hn::Max(p2, p10), hn::Max(p6, p14)));
  const V8 dark_bound2 = hn::Max(dark_bound, hn::Max(hn::Min(p2, p10), hn::Min(p6, p14)));
  const V8 bound2 = hn::Max(hn::SaturatedSub(bright_bound2, centre), hn::SaturatedSub(centre, dark_bound2));
  if (hn::AllTrue(d, hn::Eq(hn::SaturatedSub(bound2, threshold), zero))) return zero;

  const V8 p[16] = {p0,  hn::LoadU(d, c - 3 * s + 1), p2,  hn::LoadU(d, c - s + 3),
                    p4,  hn::LoadU(d, c + s + 3),     p6,  hn::LoadU(d, c + 3 * s + 1),
                    p8,  hn::LoadU(d, c + 3 * s - 1), p10, hn::LoadU(d, c + s - 3),
                    p12, hn::LoadU(d, c - s - 3),     p14, hn::LoadU(d, c - 3 * s - 1)};
  V8 low2[8], high2[8], low4[8], high4[8];  // element j starts at position 2 j + 1
  for (int j = 0; j < 8; ++j) {
    low2[j] = hn::Min(p[2 * j + 1], p[(2 * j + 2) % 16]);
    high2[j] = hn::Max(p[2 * j + 1], p[(2 * j + 2) % 16]);
  }
  for (int j = 0; j < 8; ++j) {
    low4[j] = hn::Min(low2[j], low2[(j + 1) % 8]);
    high4[j] = hn::Max(high2[j], high2[(j + 1) % 8]);
  }
  V8 bright = zero, dark = hn::Set(d, 255);
  for (int j = 0; j < 8; ++j) {
    const V8 low8 = hn::Min(low4[j], low4[(j + 2) % 8]), high8 = hn::Max(high4[j], high4[(j + 2) % 8]);
    const V8 first = p[2 * j], last = p[(2 * j + 9) % 16];
    bright = hn::Max(bright, hn::Min(low8, hn::Max(first, last)));
    dark = hn::Min(dark, hn::Max(high8, hn::Min(first, last)));
  }
  const V8 difference = hn::Max(hn::SaturatedSub(bright, centre), hn::SaturatedSub(centre, dark));
  const auto below = hn::Eq(hn::SaturatedSub(difference, threshold), zero);
  return hn::IfThenZeroElse(below, hn::SaturatedSub(difference, hn::Set(d, 1)));
}

bool fast_score_row(const std::uint8_t* centre_row, std::ptrdiff_t stride, int begin, int end, int threshold,
                    std::uint8_t* score) {
  const U8 d;
  const int step = static_cast<int>(hn::Lanes(d));
  const V8 limit = hn::Set(d, static_cast<std::uint8_t>(threshold));
  V8 any = hn::Zero(d);
  int x = begin;
  for (; x + step <= end; x += step) {
    const V8 s = fast_score_vector(d, centre_row + x, stride, limit);
    hn::StoreU(s, d, score + x);
    any = hn::Or(any, s);
  }
  if (x < end) {  // part of a vector
    alignas(64) std::uint8_t rest[kRowAlignment];
    const V8 inside = hn::IfThenElseZero(hn::FirstN(d, static_cast<std::size_t>(end - x)),
                                         fast_score_vector(d, centre_row + x, stride, limit));
    hn::Store(inside, d, rest);
    std::copy_n(rest, end - x, score + x);
    any = hn::Or(any, inside);
  }
  return !hn::AllTrue(d, hn::Eq(any, hn::Zero(d)));
}

int maxima_row(const std::uint8_t* above, const std::uint8_t* here, const std::uint8_t* below, int begin,
               int end, std::uint16_t* out) {
  const U8 d;
  const V8 zero = hn::Zero(d);
  const int step = static_cast<int>(hn::Lanes(d));
  int count = 0;
  for (int x = begin; x < end; x += step) {
    const V8 s = hn::LoadU(d, here + x);
    if (hn::AllTrue(d, hn::Eq(s, zero))) continue;
    const auto max3 = [&](const std::uint8_t* row) HWY_ATTR {
      return hn::Max(hn::Max(hn::LoadU(d, row + x - 1), hn::LoadU(d, row + x)), hn::LoadU(d, row + x + 1));
    };
    const V8 before = hn::Max(max3(above), hn::LoadU(d, here + x - 1));
    const V8 after = hn::Max(max3(below), hn::LoadU(d, here + x + 1));
    const auto not_below = hn::Eq(hn::SaturatedSub(before, s), zero);
    const auto not_above = hn::Eq(hn::SaturatedSub(s, after), zero);
    std::uint64_t bits = 0;
    hn::StoreMaskBits(d, hn::AndNot(not_above, not_below), reinterpret_cast<std::uint8_t*>(&bits));
    if (end - x < 64) bits &= (std::uint64_t{1} << (end - x)) - 1;  // of the last vector, what is inside
    for (; bits != 0; bits &= bits - 1) out[count++] = static_cast<std::uint16_t>(x + __builtin_ctzll(bits));
  }
  return count;
}

// 255 inside the disc of the centroid, by row distance and column -15..16.
struct DiscMask {
  std::uint8_t row[kPatchRadiusPx + 1][2 * kPatchRadiusPx + 2] = {};
  constexpr DiscMask() {
    for (int y = 0; y <= kPatchRadiusPx; ++y) {
      for (int x = -kPatchRadiusPx; x <= kPatchRadiusPx; ++x) {
        const int half = kDiscHalfWidthPx[y];
        row[y][x + kPatchRadiusPx] = (x >= -half && x <= half) ? 255 : 0;
      }
    }
  }
};

CentroidMoments centroid(const std::uint8_t* centre, std::ptrdiff_t stride) {
  static constexpr DiscMask kMask;
  const hn::CappedTag<std::int16_t, 16> d;
  const hn::Rebind<std::uint8_t, decltype(d)> d8;
  constexpr int kColumns = 2 * kPatchRadiusPx + 2;
  const int step = static_cast<int>(hn::Lanes(d));
  // Column sums of I and of y * I fit 16 bits: 31 * 255, and 255 * (1 + ... + 15).
  alignas(64) std::int16_t sum[kColumns], y_sum[kColumns];
  for (int x = 0; x < kColumns; x += step) {
    const auto load = [&](int y) HWY_ATTR {
      const auto pixels = hn::LoadU(d8, centre + y * stride + x - kPatchRadiusPx);
      return hn::PromoteTo(d, hn::And(pixels, hn::LoadU(d8, kMask.row[y < 0 ? -y : y] + x)));
    };
    auto s = load(0);
    auto ys = hn::Zero(d);
    for (int y = 1; y <= kPatchRadiusPx; ++y) {
      const auto lower = load(y), upper = load(-y);
      s = hn::Add(s, hn::Add(lower, upper));
      ys = hn::Add(ys, hn::Mul(hn::Set(d, static_cast<std::int16_t>(y)), hn::Sub(lower, upper)));
    }
    hn::Store(s, d, sum + x);
    hn::Store(ys, d, y_sum + x);
  }
  CentroidMoments m;
  for (int x = 0; x < kColumns; ++x) {
    m.m10 += (x - kPatchRadiusPx) * sum[x];
    m.m01 += y_sum[x];
  }
  return m;
}

// Nothing to gain from vectors: four loads a pair are the cost, gathers included.
void compare_pairs(const std::uint8_t* HWY_RESTRICT patch, const std::uint16_t* HWY_RESTRICT offsets,
                   std::uint64_t bits[4]) {
  for (int word = 0; word < 4; ++word) {
    std::uint64_t b = 0;
#pragma GCC unroll 8
    for (int i = 63; i >= 0; --i) {
      const std::uint16_t* pair = offsets + 2 * (64 * word + i);
      b = b + b + static_cast<std::uint64_t>(patch[pair[0]] < patch[pair[1]]);
    }
    bits[word] = b;
  }
}

void hamming(const std::uint64_t query[4], const std::uint64_t* HWY_RESTRICT descriptors,
             const std::uint32_t* HWY_RESTRICT indices, int count, std::uint16_t* HWY_RESTRICT distances) {
  constexpr int kWords = 4;
  const auto other = [&](int i) { return descriptors + kWords * static_cast<std::size_t>(indices[i]); };
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_SSE4
  // One instruction a word, and no sum over the lanes of a vector.
  for (int i = 0; i < count; ++i) {
    const std::uint64_t* const d = other(i);
    int sum = 0;
    for (int w = 0; w < kWords; ++w) sum += __builtin_popcountll(query[w] ^ d[w]);
    distances[i] = static_cast<std::uint16_t>(sum);
  }
#else
  const hn::CappedTag<std::uint64_t, kWords> d;
  const int step = static_cast<int>(hn::Lanes(d));
  for (int i = 0; i < count; ++i) {
    auto sum = hn::Zero(d);
    for (int w = 0; w < kWords; w += step)
      sum = hn::Add(sum, hn::PopulationCount(hn::Xor(hn::LoadU(d, query + w), hn::LoadU(d, other(i) + w))));
    distances[i] = static_cast<std::uint16_t>(hn::GetLane(hn::SumOfLanes(d, sum)));
  }
#endif
}

int near_words(std::uint64_t query, const std::uint64_t* HWY_RESTRICT words, int count, int max_bits,
               std::uint32_t* HWY_RESTRICT out) {
  const hn::CappedTag<std::uint64_t, 8> d;
  const hn::Repartition<std::uint8_t, decltype(d)> d8;
  const hn::RebindToSigned<decltype(d)> di;  // no comparison of unsigned words in AVX2
  const auto q = hn::Set(d, query);
  const auto limit = hn::Set(di, std::int64_t{max_bits} + 1);
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto is_near = [&](int i) HWY_ATTR {
    const auto difference = hn::BitCast(d8, hn::Xor(q, hn::LoadU(d, words + i)));
    return hn::Lt(hn::BitCast(di, hn::SumsOf8(hn::PopulationCount(difference))), limit);
  };
  int found = 0;
  for (int i = 0; i < count; i += 2 * lanes) {
    const auto low = is_near(i), high = is_near(i + lanes);
    if (hn::AllFalse(di, hn::Or(low, high))) continue;
    std::uint64_t bits = 0, high_bits = 0;
    hn::StoreMaskBits(di, low, reinterpret_cast<std::uint8_t*>(&bits));
    hn::StoreMaskBits(di, high, reinterpret_cast<std::uint8_t*>(&high_bits));
    bits |= high_bits << lanes;
    if (count - i < 2 * lanes) bits &= (std::uint64_t{1} << (count - i)) - 1;  // what is inside
    for (; bits != 0; bits &= bits - 1) out[found++] = static_cast<std::uint32_t>(i + __builtin_ctzll(bits));
  }
  return found;
}

int select_in_band(const PointArrays& points, const PositionRange* HWY_RESTRICT ranges, int range_count,
                   const Band& band, std::uint32_t* HWY_RESTRICT out) {
  const hn::CappedTag<float, 16> d;
  const auto u0 = hn::Set(d, band.u_px), v0 = hn::Set(d, band.v_px);
  const auto along_u = hn::Set(d, band.along_u), along_v = hn::Set(d, band.along_v);
  const auto half_width = hn::Set(d, band.half_width_px);
  const auto first = hn::Set(d, -band.half_width_px), last = hn::Set(d, band.length_px + band.half_width_px);
  const auto min_level = hn::Set(d, band.min_level), max_level = hn::Set(d, band.max_level);
  const auto angle = hn::Set(d, band.angle_rad), max_turn = hn::Set(d, band.max_turn_rad);
  const auto whole_turn = hn::Set(d, 6.2831853F);
  const int step = static_cast<int>(hn::Lanes(d));
  const float *const u_px = points.u_px, *const v_px = points.v_px, *const angle_rad = points.angle_rad,
                     *const levels = points.level;
  const auto in_band = [&](int i) HWY_ATTR {
    const auto du = hn::Sub(hn::LoadU(d, u_px + i), u0), dv = hn::Sub(hn::LoadU(d, v_px + i), v0);
    const auto along = hn::Add(hn::Mul(du, along_u), hn::Mul(dv, along_v));
    const auto across = hn::Abs(hn::Sub(hn::Mul(dv, along_u), hn::Mul(du, along_v)));
    const auto inside =
        hn::And(hn::Le(across, half_width), hn::And(hn::Ge(along, first), hn::Le(along, last)));
    const auto turn = hn::Abs(hn::Sub(hn::LoadU(d, angle_rad + i), angle));
    const auto level = hn::LoadU(d, levels + i);
    const auto alike = hn::And(hn::Le(hn::Min(turn, hn::Sub(whole_turn, turn)), max_turn),
                               hn::And(hn::Ge(level, min_level), hn::Le(level, max_level)));
    std::uint64_t bits = 0;
    hn::StoreMaskBits(d, hn::And(inside, alike), reinterpret_cast<std::uint8_t*>(&bits));
    return bits;
  };
  int count = 0;
  for (const PositionRange* r = ranges; r != ranges + range_count; ++r) {
    for (int i = r->begin; i < r->end; i += step) {
      std::uint64_t bits = in_band(i);
      if (r->end - i < step)
        bits &= (std::uint64_t{1} << (r->end - i)) - 1;  // of the last vector, what is inside
      for (; bits != 0; bits &= bits - 1)
        out[count++] = static_cast<std::uint32_t>(i + __builtin_ctzll(bits));
    }
  }
  return count;
}

#include "slam/image/alignment_kernels.inl"

const Kernels* table() {
  static const Kernels kTable = {hwy::TargetName(HWY_TARGET),
                                 resample_row,
                                 combine_rows,
                                 blur_row,
                                 blur_column,
                                 fast_score_row,
                                 maxima_row,
                                 centroid,
                                 compare_pairs,
                                 hamming,
                                 near_words,
                                 select_in_band,
                                 smooth_patch,
                                 sample_patch,
                                 window_sums};
  return &kTable;
}
#endif  // HWY_TARGET == HWY_SCALAR

}  // namespace farpoint::slam::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <atomic>
#include <cstring>

namespace farpoint::slam {
namespace {

HWY_EXPORT(table);
std::atomic<const Kernels*> g_pinned{nullptr};

}  // namespace

const Kernels& simd_kernels() {
  return *HWY_DYNAMIC_DISPATCH(table)();
}

const Kernels& active_kernels() {
  const Kernels* pinned = g_pinned.load(std::memory_order_relaxed);
  return pinned != nullptr ? *pinned : simd_kernels();
}

bool pin_kernels(const char* name) {
  if (std::strcmp(name, "auto") == 0) {
    g_pinned = nullptr;
    return true;
  }
  if (std::strcmp(name, "plain") == 0) {
    g_pinned = &plain_kernels();
    return true;
  }
  for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1) {
    const std::int64_t target = targets & -targets;
    if (std::strcmp(name, hwy::TargetName(target)) != 0) continue;
    hwy::SetSupportedTargetsForTest(target);
    g_pinned = &simd_kernels();
    hwy::SetSupportedTargetsForTest(0);
    return std::strcmp(g_pinned.load()->name, name) == 0;
  }
  return false;
}

}  // namespace farpoint::slam
#endif  // HWY_ONCE
