// SPDX-License-Identifier: Apache-2.0
// A face prepared for shading from one pose: its texture layers as functions of the ray.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "tools/simulate/render/span_kernels.h"
#include "tools/simulate/world/texture.h"

namespace farpoint::tools::simulate {

struct LayerInfo {
  const Texture* texture = nullptr;
  float inverse_period_s = 1, inverse_period_t = 1, gain = 1;
  float log2_density = 0;  // texels a metre
};

[[nodiscard]] LayerInfo layer_info(const Texture& texture, double period_s_m, double period_t_m, double gain);

struct ReadyFace {
  ShadeFace shade;
  std::array<LayerInfo, ShadeFace::kMaxLayers> info;
  int layers = 0;
  float brightness = 1;
  std::uint32_t stamp = 0;
};

// Texture coordinate s = axis . (camera + distance * ray) + origin, where `at_camera` is its value at the
// camera's place. Layers stand coarse to fine: the fine ones are the first to vanish with distance.
void add_layer(const LayerInfo& info, const Eigen::Vector3f& s_axis, float s_at_camera,
               const Eigen::Vector3f& t_axis, float t_at_camera, ReadyFace* ready);

}  // namespace farpoint::tools::simulate
