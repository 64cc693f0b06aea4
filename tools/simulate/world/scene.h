// SPDX-License-Identifier: Apache-2.0
// Input of the renderer at one time: chunks near the camera, moving objects, light, air and sky.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "tools/simulate/world/mesh.h"

namespace farpoint::tools::simulate {

// A layer of clouds that drifts with the wind, under a sky that brightens towards the horizon.
struct Sky {
  const Texture* clouds = nullptr;
  const Texture* cloud_detail = nullptr;
  double height_m = 1500.0;  // above the world's zero
  double period_m = 6000.0, detail_period_m = 700.0;
  double radiance = 1.35;
  Eigen::Vector2d wind_mps = Eigen::Vector2d::Zero();
};

struct Scene {
  const std::vector<Material>* materials = nullptr;
  std::vector<const Chunk*> chunks;
  // Cars and the like at a time. The meshes outlive the scene.
  std::function<void(double time_s, std::vector<MovingObject>* objects)> moving_at;
  Sky sky;
  double visibility_m = 20000.0;  // distance after which the share exp(-1) of light arrives
  double haze_radiance = 1.0;
  Eigen::Vector3d sway_direction = Eigen::Vector3d::UnitX();  // of foliage in the wind
};

// Foliage's displacement in the wind, as a share of its amplitude.
[[nodiscard]] double sway_at(double time_s, double phase);

}  // namespace farpoint::tools::simulate
