// SPDX-License-Identifier: Apache-2.0
// The builders of the world's parts, and their common data. Each adds what lies within one chunk; a
// part belongs to the chunk that holds its middle, and looks the same whichever chunks are built and when.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "tools/simulate/world/mesh.h"
#include "tools/simulate/world/path.h"
#include "tools/simulate/world/terrain.h"
#include "tools/simulate/world/world_description.h"

namespace farpoint::tools::simulate {

constexpr double kNearChunk_m = 128.0;  // with houses, trees, road
constexpr double kFarChunk_m = 1024.0;  // terrain and towers to the horizon
// Ground nearer to a road than this is made in near chunks.
constexpr double kNearGround_m = 350.0;

struct Site {
  const WorldDescription* world = nullptr;
  std::uint64_t seed = 0;
  const Terrain* terrain = nullptr;
  const RoadFinder* roads = nullptr;
  const Path* road = nullptr;  // of the world's road; may be empty
  double road_half_width_m = 0.0;
  std::vector<Path> streets;  // of the town's grid
  Eigen::Vector3d to_sun = Eigen::Vector3d::UnitZ();
};

constexpr double kStreetHalfWidth_m = 4.0;

// Position of a chunk, and the mesh that receives its faces.
struct ChunkSite {
  Eigen::Vector3d origin;
  double size_m;
  MeshBuilder* builder;

  [[nodiscard]] bool holds(double x, double y) const {
    return x >= origin.x() && y >= origin.y() && x < origin.x() + size_m && y < origin.y() + size_m;
  }
  [[nodiscard]] Eigen::Vector3d local(double x, double y, double z) const {
    return {x - origin.x(), y - origin.y(), z - origin.z()};
  }
};

void build_near_ground(const Site& site, const ChunkSite& chunk);
void build_far_ground(const Site& site, const ChunkSite& chunk);
void build_road(const Site& site, const ChunkSite& chunk);
void build_town(const Site& site, const ChunkSite& chunk);
void build_yard(const Site& site, const ChunkSite& chunk);
void build_wilderness(const Site& site, const ChunkSite& chunk);
void build_towers(const Site& site, const ChunkSite& chunk);

[[nodiscard]] double road_width_m(RoadSurface surface);

// Sun and cast shadows over a chunk; `mesh` casts them. One texel is size / texels.
[[nodiscard]] std::unique_ptr<Texture> bake_light(const Site& site, const ChunkSite& chunk, const Mesh& mesh,
                                                  const std::vector<Material>& materials, int texels,
                                                  double height_step_m);

}  // namespace farpoint::tools::simulate
