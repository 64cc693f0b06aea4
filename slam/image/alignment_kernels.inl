// SPDX-License-Identifier: Apache-2.0
// Kernels of patch alignment: part of kernels_simd.cc, compiled once for every instruction set inside its
// namespace. A template row has eight pixels: one vector of eight floats or two of four. No fused
// multiply-add: not every instruction set has it, and the bits must be the same.

using F32 = hn::CappedTag<float, kTemplateSide>;
using VF = hn::Vec<F32>;
inline constexpr int kLanes = static_cast<int>(hn::MaxLanes(F32()));
inline constexpr int kParts = kTemplateSide / kLanes;  // vectors a row

// Integers until the last step, so that neither the order nor the direction of the sums matters.
void smooth_patch(const std::uint8_t* HWY_RESTRICT patch, float* HWY_RESTRICT out) {
  constexpr int kSide = kAlignPatchSide;
  const hn::FixedTag<std::uint8_t, kSide> d8;
  const hn::Half<decltype(d8)> d8_half;
  const hn::Rebind<std::uint16_t, decltype(d8_half)> d16;
  const F32 df;
  const hn::Rebind<std::uint16_t, F32> d16_of_float;
  const hn::Rebind<std::int32_t, F32> d32;
  // Each pixel's neighbours along the row; at the ends the pixel itself.
  alignas(16) static constexpr std::uint8_t kLeft[kSide] = {0, 0, 1, 2,  3,  4,  5,  6,
                                                            7, 8, 9, 10, 11, 12, 13, 14};
  alignas(16) static constexpr std::uint8_t kRight[kSide] = {1, 2,  3,  4,  5,  6,  7,  8,
                                                             9, 10, 11, 12, 13, 14, 15, 15};
  const auto left = hn::Load(d8, kLeft), right = hn::Load(d8, kRight);
  using V16 = hn::Vec<decltype(d16)>;
  struct Row {
    V16 low, high;
  };
  const auto along_row = [&](int y) HWY_ATTR {
    const auto here = hn::LoadU(d8, patch + y * kSide);
    const auto before = hn::TableLookupBytes(here, left), behind = hn::TableLookupBytes(here, right);
    const auto low = [&](auto v) HWY_ATTR { return hn::PromoteTo(d16, hn::LowerHalf(d8_half, v)); };
    const auto high = [&](auto v) HWY_ATTR { return hn::PromoteTo(d16, hn::UpperHalf(d8_half, v)); };
    return Row{hn::Add(hn::Add(low(before), low(behind)), hn::Add(low(here), low(here))),
               hn::Add(hn::Add(high(before), high(behind)), hn::Add(high(here), high(here)))};
  };
  const auto sixteenth = hn::Set(df, 0.0625F);
  alignas(64) std::uint16_t sums[kSide];
  Row above = along_row(0), here = above;
  for (int y = 0; y < kSide; ++y) {
    const Row below = y + 1 < kSide ? along_row(y + 1) : here;
    const auto down = [](V16 a, V16 b, V16 c) HWY_ATTR { return hn::Add(hn::Add(a, c), hn::Add(b, b)); };
    hn::Store(down(above.low, here.low, below.low), d16, sums);
    hn::Store(down(above.high, here.high, below.high), d16, sums + kSide / 2);
    for (int x = 0; x < kSide; x += kLanes) {
      const auto wide = hn::PromoteTo(d32, hn::Load(d16_of_float, sums + x));
      hn::StoreU(hn::Mul(hn::ConvertTo(df, wide), sixteenth), df, out + y * kSide + x);
    }
    above = here;
    here = below;
  }
}

struct SplineVectors {
  VF weight[3], slope[3];
};
HWY_INLINE SplineVectors spline(VF t) {
  const F32 d;
  const VF half = hn::Set(d, 0.5F), eighth = hn::Set(d, 0.125F);
  const VF square = hn::Mul(t, t), half_square = hn::Mul(half, square), half_t = hn::Mul(half, t);
  return {{hn::Add(hn::Sub(eighth, half_t), half_square), hn::Sub(hn::Set(d, 0.75F), square),
           hn::Add(hn::Add(eighth, half_t), half_square)},
          {hn::Sub(t, half), hn::Mul(hn::Set(d, -2.0F), t), hn::Add(t, half)}};
}
HWY_INLINE VF mix3(const VF w[3], VF a, VF b, VF c) {
  return hn::Add(hn::Add(hn::Mul(w[0], a), hn::Mul(w[1], b)), hn::Mul(w[2], c));
}

void sample_patch(const float* HWY_RESTRICT smooth, const PatchSampling& s, PatchTemplate* HWY_RESTRICT out) {
  const F32 d;
  const hn::RebindToSigned<F32> di;
  const VF half = hn::Set(d, 0.5F), share = hn::Set(d, s.share);
  const VF xi = hn::Set(d, s.xi), xj = hn::Set(d, s.xj), yi = hn::Set(d, s.yi), yj = hn::Set(d, s.yj);
  for (int at = 0; at < kTemplateCount; at += kLanes) {
    const VF i = hn::Iota(d, static_cast<float>(at % kTemplateSide));
    const VF j = hn::Set(d, static_cast<float>(at / kTemplateSide));
    const VF x = hn::Add(hn::Add(hn::Set(d, s.x0), hn::Mul(xj, j)), hn::Mul(xi, i));
    const VF y = hn::Add(hn::Add(hn::Set(d, s.y0), hn::Mul(yj, j)), hn::Mul(yi, i));
    const auto nearest_x = hn::ConvertTo(di, hn::Add(x, half)),
               nearest_y = hn::ConvertTo(di, hn::Add(y, half));
    const SplineVectors wx = spline(hn::Sub(x, hn::ConvertTo(d, nearest_x))),
                        wy = spline(hn::Sub(y, hn::ConvertTo(d, nearest_y)));
    const auto index = hn::Add(hn::ShiftLeft<4>(nearest_y), nearest_x);
    static_assert(kAlignPatchSide == 1 << 4);
    VF across[3], down[3];
    for (int k = 0; k < 3; ++k) {
      const float* column = smooth + k - 1 - kAlignPatchSide;
      const VF top = hn::GatherIndex(d, column, index);
      const VF middle = hn::GatherIndex(d, column + kAlignPatchSide, index);
      const VF bottom = hn::GatherIndex(d, column + 2 * kAlignPatchSide, index);
      across[k] = mix3(wy.weight, top, middle, bottom);
      down[k] = mix3(wy.slope, top, middle, bottom);
    }
    const VF slope_x = mix3(wx.slope, across[0], across[1], across[2]);
    const VF slope_y = mix3(wx.weight, down[0], down[1], down[2]);
    const auto add = [&](VF what, float* to) HWY_ATTR {
      hn::Store(hn::Add(hn::Load(d, to + at), hn::Mul(share, what)), d, to + at);
    };
    add(mix3(wx.weight, across[0], across[1], across[2]), out->value);
    add(hn::Add(hn::Mul(xi, slope_x), hn::Mul(yi, slope_y)), out->dx);
    add(hn::Add(hn::Mul(xj, slope_x), hn::Mul(yj, slope_y)), out->dy);
  }
}

// ((s0 + s1) + (s2 + s3)) + ((s4 + s5) + (s6 + s7)) of the eight partial sums.
HWY_INLINE float total(const VF parts[kParts]) {
  const F32 d;
  alignas(64) float s[kTemplateSide];
  for (int part = 0; part < kParts; ++part) hn::Store(parts[part], d, s + part * kLanes);
  return ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
}

WindowSums window_sums(const std::uint8_t* HWY_RESTRICT corner, std::ptrdiff_t stride, const float wx[5],
                       const float wy[5], const PatchTemplate& with) {
  const F32 d;
  const hn::Rebind<std::uint8_t, F32> d8;
  const hn::RebindToSigned<F32> di;
  constexpr int kRows = kTemplateSide + 4;
  VF value[kParts], square[kParts], along[kParts], dx[kParts], dy[kParts];
  VF window[kTemplateSide][kParts];
  for (int part = 0; part < kParts; ++part) {
    const int first = part * kLanes;
    VF rows[kRows];
    for (int r = 0; r < kRows; ++r) {
      const std::uint8_t* p = corner + r * stride + first;
      const auto pixels = [&](int k)
                              HWY_ATTR { return hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(d8, p + k))); };
      VF sum = hn::Mul(hn::Set(d, wx[0]), pixels(0));
      for (int k = 1; k < 5; ++k) sum = hn::Add(sum, hn::Mul(hn::Set(d, wx[k]), pixels(k)));
      rows[r] = sum;
    }
    for (int r = 0; r < kTemplateSide; ++r) {
      VF sum = hn::Mul(hn::Set(d, wy[0]), rows[r]);
      for (int k = 1; k < 5; ++k) sum = hn::Add(sum, hn::Mul(hn::Set(d, wy[k]), rows[r + k]));
      window[r][part] = sum;
    }
  }
  const VF reference = hn::Set(d, hn::GetLane(window[kTemplateSide / 2][0]));
  for (int part = 0; part < kParts; ++part) {
    value[part] = square[part] = along[part] = dx[part] = dy[part] = hn::Zero(d);
    for (int r = 0; r < kTemplateSide; ++r) {
      const int at = r * kTemplateSide + part * kLanes;
      const VF v = hn::Sub(window[r][part], reference);
      value[part] = hn::Add(value[part], v);
      square[part] = hn::Add(square[part], hn::Mul(v, v));
      along[part] = hn::Add(along[part], hn::Mul(v, hn::Load(d, with.value + at)));
      dx[part] = hn::Add(dx[part], hn::Mul(v, hn::Load(d, with.dx + at)));
      dy[part] = hn::Add(dy[part], hn::Mul(v, hn::Load(d, with.dy + at)));
    }
  }
  return {total(value), total(square), total(along), total(dx), total(dy)};
}
