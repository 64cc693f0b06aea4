// SPDX-License-Identifier: Apache-2.0
// A world made from its description and a seed, at any time. Makes ground, houses and trees in chunks around
// the moving camera.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "tools/simulate/world/materials.h"
#include "tools/simulate/world/scene.h"
#include "tools/simulate/world/site.h"

namespace farpoint::tools::simulate {

class World {
 public:
  // Precondition: the description has passed the checks of its reader. `duration_s` bounds how much of an
  // endless road there is.
  World(const WorldDescription& description, std::uint64_t seed, double duration_s);
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  [[nodiscard]] const WorldDescription& description() const { return description_; }
  [[nodiscard]] std::uint64_t seed() const { return site_.seed; }
  [[nodiscard]] const Terrain& terrain() const { return *terrain_; }
  // Where the vehicle drives: the road's or the streets' centre line, or the way around the yard.
  [[nodiscard]] const Path& route() const { return route_; }

  // Returns the visible scene at a place; valid until the next call. Makes and drops chunks. The caller sets
  // moving objects.
  [[nodiscard]] Scene scene_around(const Eigen::Vector3d& position);

 private:
  using Key = std::pair<long long, long long>;
  struct Ring;

  void make_routes(double duration_s);
  [[nodiscard]] std::unique_ptr<Chunk> make_chunk(const Key& key, bool is_near) const;
  void visit(const Eigen::Vector3d& position, bool is_near, std::vector<const Chunk*>* chunks);

  WorldDescription description_;
  MaterialLibrary materials_;
  std::unique_ptr<Texture> clouds_, cloud_detail_;
  Path road_, route_;
  RoadFinder roads_;
  std::unique_ptr<Terrain> terrain_;
  Site site_;
  // Nothing where a near chunk has no ground of its own.
  std::map<Key, std::unique_ptr<Chunk>> near_, far_;
};

}  // namespace farpoint::tools::simulate
