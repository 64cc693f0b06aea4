// SPDX-License-Identifier: Apache-2.0
// Height and cover of the ground as functions of the place.
#pragma once

#include <cstdint>

#include "tools/simulate/world/path.h"
#include "tools/simulate/world/world_description.h"

namespace farpoint::tools::simulate {

// Two parts: a gentle base, which roads and houses follow as it is, and hills and mountains that begin at
// some distance from the roads.
class Terrain {
 public:
  Terrain(const TerrainDescription& description, std::uint64_t seed, const RoadFinder* roads)
      : d_(description), seed_(seed), roads_(roads) {}

  // Height of roads and built ground.
  [[nodiscard]] double base(double x, double y) const;
  // Height of the ground at a given distance from the roads.
  [[nodiscard]] double height(double x, double y, double road_distance_m) const;
  [[nodiscard]] double height(double x, double y) const { return height(x, y, roads_->distance_m(x, y)); }
  // MaterialId of the ground.
  [[nodiscard]] int material(double x, double y, double height_m, double slope, double road_distance_m) const;

 private:
  TerrainDescription d_;
  std::uint64_t seed_;
  const RoadFinder* roads_;
};

}  // namespace farpoint::tools::simulate
