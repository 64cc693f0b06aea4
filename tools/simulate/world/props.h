// SPDX-License-Identifier: Apache-2.0
// Props: trees, houses, cars, lamps, signs. Each becomes clusters of a mesh; places are in
// the mesh's own axes, on the ground.
#pragma once

#include <Eigen/Core>

#include "tools/simulate/world/mesh.h"
#include "tools/simulate/world/random.h"

namespace farpoint::tools::simulate {

struct Spot {
  Eigen::Vector3d base = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;  // of its x axis (front, or along the street)

  [[nodiscard]] Eigen::Vector3d at(double x, double y, double z) const {
    const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
    return base + Eigen::Vector3d(c * x - s * y, s * x + c * y, z);
  }
  [[nodiscard]] Spot moved(double x, double y, double z, double turn_rad = 0.0) const {
    return {at(x, y, z), yaw_rad + turn_rad};
  }
};

enum class TreeDetail { kNear, kFar };
void add_tree(MeshBuilder* builder, const Spot& spot, double height_m, TreeDetail detail, Random* random);
void add_bush(MeshBuilder* builder, const Spot& spot, double size_m, Random* random);
void add_rock(MeshBuilder* builder, const Spot& spot, double size_m, Random* random);

struct HouseSize {
  double width_m, depth_m;
  int floors;
  bool has_shop;
  bool detached;  // a gabled roof and windows on all sides
};
// Its front is at y = 0 and spans x = 0 to width; it extends to y = depth.
void add_house(MeshBuilder* builder, const Spot& spot, const HouseSize& size, Random* random);

void add_car(MeshBuilder* builder, const Spot& spot, double paint);
void add_lamp(MeshBuilder* builder, const Spot& spot, double height_m, double arm_m);
void add_sign(MeshBuilder* builder, const Spot& spot, double size_m, double height_m, Random* random);
// Spans y = -half_span to half_span across the road; its boards face -x.
void add_gantry(MeshBuilder* builder, const Spot& spot, double half_span_m, Random* random);
void add_box(MeshBuilder* builder, const Spot& spot, const Eigen::Vector3d& size_m, int material,
             double paint);
void add_tower(MeshBuilder* builder, const Spot& spot, double height_m, Random* random);

}  // namespace farpoint::tools::simulate
