// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/render/span_kernels.h"

#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tools/simulate/render/span_kernels.cc"
#include <hwy/foreach_target.h>  // must come before highway.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace farpoint::tools::simulate {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using F = hn::CappedTag<float, 16>;
using I = hn::Rebind<std::int32_t, F>;
using U = hn::Rebind<std::uint32_t, F>;
using VF = hn::Vec<F>;

void fill(float first, float slope, std::uint32_t value, int count, float* HWY_RESTRICT inverse_depth,
          std::uint32_t* HWY_RESTRICT id) {
  const F d;
  const U du;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const VF step = hn::Set(d, slope), start = hn::Set(d, first);
  const auto values = hn::Set(du, value);
  int i = 0;
  for (; i + lanes <= count; i += lanes) {
    const VF mine = hn::Add(start, hn::Mul(step, hn::Iota(d, static_cast<float>(i))));
    const VF theirs = hn::LoadU(d, inverse_depth + i);
    const auto nearer = hn::Gt(mine, theirs);
    if (hn::AllFalse(d, nearer)) continue;
    hn::StoreU(hn::IfThenElse(nearer, mine, theirs), d, inverse_depth + i);
    hn::StoreU(hn::IfThenElse(hn::RebindMask(du, nearer), values, hn::LoadU(du, id + i)), du, id + i);
  }
  for (; i < count; ++i) {
    const float mine = first + slope * static_cast<float>(i);
    if (mine > inverse_depth[i]) {
      inverse_depth[i] = mine;
      id[i] = value;
    }
  }
}

void fill_cutout(const CutoutRow& row, std::uint32_t value, int count, float* HWY_RESTRICT inverse_depth,
                 std::uint32_t* HWY_RESTRICT id) {
  const F d;
  const U du;
  const I di;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto along = [d](float start, float step, VF i)
                         HWY_ATTR { return hn::Add(hn::Set(d, start), hn::Mul(hn::Set(d, step), i)); };
  // Depths and ids have room for a whole vector behind their end; what lies there is put back.
  for (int at = 0; at < count; at += lanes) {
    const VF i = hn::Iota(d, static_cast<float>(at));
    const VF mine = along(row.inverse_depth, row.d_inverse_depth, i);
    const VF theirs = hn::LoadU(d, inverse_depth + at);
    auto drawn = hn::And(hn::Gt(mine, theirs), hn::FirstN(d, static_cast<std::size_t>(count - at)));
    if (hn::AllFalse(d, drawn)) continue;
    const VF inverse = hn::Div(hn::Set(d, 1.0F), along(row.den, row.d_den, i));
    const auto x = hn::ConvertTo(di, hn::Floor(hn::Mul(along(row.u, row.du, i), inverse)));
    const auto y = hn::ConvertTo(di, hn::Floor(hn::Mul(along(row.v, row.dv, i), inverse)));
    const auto offset = hn::Add(hn::Mul(hn::And(y, hn::Set(di, row.mask_y)), hn::Set(di, row.stride)),
                                hn::And(x, hn::Set(di, row.mask_x)));
    const auto texels = hn::GatherOffset(di, reinterpret_cast<const std::int32_t*>(row.texels), offset);
    const auto solid = hn::Gt(hn::And(texels, hn::Set(di, 255)), hn::Set(di, row.threshold - 1));
    drawn = hn::And(drawn, hn::RebindMask(d, solid));
    hn::StoreU(hn::IfThenElse(drawn, mine, theirs), d, inverse_depth + at);
    hn::StoreU(hn::IfThenElse(hn::RebindMask(du, drawn), hn::Set(du, value), hn::LoadU(du, id + at)), du,
               id + at);
  }
}

HWY_INLINE VF dot(F d, const float a[3], VF x, VF y, VF z) {
  return hn::Add(hn::Add(hn::Mul(hn::Set(d, a[0]), x), hn::Mul(hn::Set(d, a[1]), y)),
                 hn::Mul(hn::Set(d, a[2]), z));
}

// Bilinear texel of [0, 255]. One 32-bit load brings a texel and its right neighbour.
HWY_INLINE VF texel(F d, const ShadeLayer& layer, VF u, VF v) {
  const I di;
  const VF half = hn::Set(d, 0.5F);
  const VF x = hn::Sub(hn::Mul(u, hn::Set(d, layer.width)), half);
  const VF y = hn::Sub(hn::Mul(v, hn::Set(d, layer.height)), half);
  const VF fx = hn::Floor(x), fy = hn::Floor(y);
  const VF ax = hn::Sub(x, fx), ay = hn::Sub(y, fy);
  const auto ix = hn::And(hn::ConvertTo(di, fx), hn::Set(di, layer.mask_x));
  const auto iy = hn::ConvertTo(di, fy);
  const auto mask_y = hn::Set(di, layer.mask_y), stride = hn::Set(di, layer.stride);
  const auto top = hn::Add(hn::Mul(hn::And(iy, mask_y), stride), ix);
  const auto bottom = hn::Add(hn::Mul(hn::And(hn::Add(iy, hn::Set(di, 1)), mask_y), stride), ix);
  const auto* base = reinterpret_cast<const std::int32_t*>(layer.texels);
  const auto upper = hn::GatherOffset(di, base, top), lower = hn::GatherOffset(di, base, bottom);
  const auto byte = hn::Set(di, 255);
  const VF a = hn::ConvertTo(d, hn::And(upper, byte));
  const VF b = hn::ConvertTo(d, hn::And(hn::ShiftRight<8>(upper), byte));
  const VF c = hn::ConvertTo(d, hn::And(lower, byte));
  const VF e = hn::ConvertTo(d, hn::And(hn::ShiftRight<8>(lower), byte));
  const VF first = hn::Add(a, hn::Mul(ax, hn::Sub(b, a))), second = hn::Add(c, hn::Mul(ax, hn::Sub(e, c)));
  return hn::Add(first, hn::Mul(ay, hn::Sub(second, first)));
}

HWY_INLINE VF shaded(F d, const ShadeFace& face, VF x, VF y, VF z) {
  const VF one = hn::Set(d, 1.0F);
  const VF inverse = hn::Div(one, hn::Max(dot(d, face.den, x, y, z), hn::Set(d, face.min_den)));
  VF light = hn::Set(d, face.brightness);
  for (int i = 0; i < face.layers; ++i) {
    const ShadeLayer& layer = face.layer[i];
    const VF u = hn::Mul(dot(d, layer.u_num, x, y, z), inverse);
    const VF v = hn::Mul(dot(d, layer.v_num, x, y, z), inverse);
    light = hn::Mul(light, hn::Mul(hn::Set(d, layer.gain), texel(d, layer, u, v)));
  }
  // exp(-q) as 1 / (1 + q + q^2/2 + q^3/6): no exponential, and never negative.
  const VF q = hn::Mul(hn::Set(d, face.plane_m * face.haze_per_m), inverse);
  const VF cubic = hn::Add(hn::Set(d, 0.5F), hn::Mul(q, hn::Set(d, 1.0F / 6.0F)));
  const VF clear = hn::Div(one, hn::Add(one, hn::Mul(q, hn::Add(one, hn::Mul(q, cubic)))));
  const VF haze = hn::Set(d, face.haze_radiance);
  return hn::Add(haze, hn::Mul(clear, hn::Sub(light, haze)));
}

void shade(const ShadeFace& face, const RaySpan& rays, int count, float weight, float* radiance) {
  const F d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const VF w = hn::Set(d, weight);
  // Rays and radiance have room for a whole vector behind their end; what lies there is put back.
  for (int i = 0; i < count; i += lanes) {
    const VF light =
        shaded(d, face, hn::LoadU(d, rays.x + i), hn::LoadU(d, rays.y + i), hn::LoadU(d, rays.z + i));
    const auto mine = hn::FirstN(d, static_cast<std::size_t>(count - i));
    const VF before = hn::LoadU(d, radiance + i);
    hn::StoreU(hn::Add(before, hn::IfThenElseZero(mine, hn::Mul(w, light))), d, radiance + i);
  }
}

const SpanKernels* table() {
  static constexpr SpanKernels kTable = {fill, fill_cutout, shade};
  return &kTable;
}

}  // namespace HWY_NAMESPACE
}  // namespace farpoint::tools::simulate
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace farpoint::tools::simulate {
namespace {
HWY_EXPORT(table);
}  // namespace

const SpanKernels& span_kernels() {
  static const SpanKernels& kernels = *HWY_DYNAMIC_DISPATCH(table)();
  return kernels;
}

}  // namespace farpoint::tools::simulate
#endif  // HWY_ONCE
