// SPDX-License-Identifier: Apache-2.0
// The two inner loops of the renderer, for runs of pixels of one face. Written with Highway's run-time
// dispatch; products and sums are rounded one by one on every instruction set, so that a world looks the
// same, to the byte, on all of them.
#pragma once

#include <cstdint>

namespace farpoint::tools::simulate {

// One texture over a face, seen from one place. For a ray d of a pixel: u = (u_num . d) / (den . d), in
// repetitions; times the level's size it counts texels.
struct ShadeLayer {
  float u_num[3], v_num[3];
  float gain = 1.0F;
  // Of the chosen level:
  const std::uint8_t* texels = nullptr;
  float width = 1.0F, height = 1.0F;
  std::int32_t mask_x = 0, mask_y = 0, stride = 0;
};

struct ShadeFace {
  static constexpr int kMaxLayers = 4;
  float den[3];           // normal in camera axes; distance along a unit ray is plane_m / (den . d)
  float plane_m = 0;      // > 0: distance of the camera from the face's plane
  float min_den = 1e-6F;  // smaller denominators count as this: the sky's horizon
  float brightness = 1.0F;
  float haze_per_m = 0;  // 1 / visibility
  float haze_radiance = 0;
  int layers = 0;
  ShadeLayer layer[kMaxLayers];
};

// Rays of consecutive pixels, unit length, camera axes.
struct RaySpan {
  const float* x;
  const float* y;
  const float* z;
};

// Texture coordinates along a row of a face with holes: at cell i, u = (u + i du) / (den + i d_den), in
// texels.
struct CutoutRow {
  float inverse_depth, d_inverse_depth;
  float u, du, v, dv, den, d_den;
  const std::uint8_t* texels = nullptr;
  std::int32_t mask_x = 0, mask_y = 0, stride = 0;
  std::int32_t threshold = 128;  // texels below are holes
};

struct SpanKernels {
  // inverse_depth[i] and id[i] become `first + i * slope` and `value` where that is nearer (larger).
  void (*fill)(float first, float slope, std::uint32_t value, int count, float* inverse_depth,
               std::uint32_t* id);
  // The same where the texture has no hole.
  void (*fill_cutout)(const CutoutRow& row, std::uint32_t value, int count, float* inverse_depth,
                      std::uint32_t* id);
  // radiance[i] += weight * what is seen along ray i.
  void (*shade)(const ShadeFace& face, const RaySpan& rays, int count, float weight, float* radiance);
};

[[nodiscard]] const SpanKernels& span_kernels();

}  // namespace farpoint::tools::simulate
