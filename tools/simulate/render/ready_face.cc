// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/render/ready_face.h"

#include <algorithm>
#include <cmath>

namespace farpoint::tools::simulate {

LayerInfo layer_info(const Texture& texture, double period_s_m, double period_t_m, double gain) {
  LayerInfo info;
  info.texture = &texture;
  info.inverse_period_s = static_cast<float>(1.0 / period_s_m);
  info.inverse_period_t = static_cast<float>(1.0 / period_t_m);
  info.gain = static_cast<float>(gain);
  info.log2_density =
      std::log2(static_cast<float>(std::max(texture.width() / period_s_m, texture.height() / period_t_m)));
  return info;
}

void add_layer(const LayerInfo& info, const Eigen::Vector3f& s_axis, float s_at_camera,
               const Eigen::Vector3f& t_axis, float t_at_camera, ReadyFace* ready) {
  ShadeFace& shade = ready->shade;
  const Eigen::Map<const Eigen::Vector3f> den(shade.den);
  int at = ready->layers++;
  while (at > 0 && ready->info[static_cast<std::size_t>(at) - 1].log2_density > info.log2_density) {
    ready->info[static_cast<std::size_t>(at)] = ready->info[static_cast<std::size_t>(at) - 1];
    shade.layer[at] = shade.layer[at - 1];
    --at;
  }
  ready->info[static_cast<std::size_t>(at)] = info;
  ShadeLayer& layer = shade.layer[at];
  layer.gain = info.gain;
  // Whole repetitions are taken off: small numbers keep more digits.
  float u = s_at_camera * info.inverse_period_s, v = t_at_camera * info.inverse_period_t;
  u -= std::floor(u);
  v -= std::floor(v);
  Eigen::Map<Eigen::Vector3f>(layer.u_num) = shade.plane_m * info.inverse_period_s * s_axis + u * den;
  Eigen::Map<Eigen::Vector3f>(layer.v_num) = shade.plane_m * info.inverse_period_t * t_axis + v * den;
}

}  // namespace farpoint::tools::simulate
