// SPDX-License-Identifier: Apache-2.0
// The surfaces of the simulated world: textures painted from the seed, and the materials made of them.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "tools/simulate/world/canvas.h"
#include "tools/simulate/world/mesh.h"
#include "tools/simulate/world/noise.h"

namespace farpoint::tools::simulate {

// Indices into MaterialLibrary::materials. "First" ones are followed by their variants.
enum MaterialId : int {
  kRoadTwoLanes,  // s across the road from its left edge, t along
  kRoadMotorway,  // one carriageway: two lanes and a hard shoulder
  kAsphalt,       // without markings
  kTrack,         // gravel with wheel ruts; s across
  kPavement,      // slabs
  kKerb,
  kGround,  // meadow; texture coordinates are world x and y
  kFields,
  kForest,  // canopy from afar
  kRock,
  kGravel,
  kFirstFacade,                    // upper floors: 12 m by three floors of 3.2 m
  kFirstShop = kFirstFacade + 10,  // ground floors: 12 m by 3.6 m
  kBrickWall = kFirstShop + 6,
  kConcrete,
  kRoofTiles,
  kRoofFlat,
  kBark,
  kFirstFoliage,  // cut out; 4 m by 4 m
  kHedge = kFirstFoliage + 3,
  kMetal,
  kFirstSign,                 // 2 m by 2 m
  kCarSide = kFirstSign + 6,  // 4.4 m by 1.5 m
  kCarFront,                  // 1.8 m by 1.5 m
  kCarRoof,
  kContainer,
  kFence,  // cut out
  kStone,
  kGlassTower,
  kMaterialCount
};

constexpr int kFacades = 10, kShops = 6, kFoliages = 3, kSigns = 6;

// Ground textures repeat after this many metres or a whole part of it.
constexpr double kGroundPeriod_m = 2048.0;

class MaterialLibrary {
 public:
  explicit MaterialLibrary(std::uint64_t seed);
  ~MaterialLibrary();
  MaterialLibrary(const MaterialLibrary&) = delete;
  MaterialLibrary& operator=(const MaterialLibrary&) = delete;

  [[nodiscard]] const std::vector<Material>& materials() const { return materials_; }
  // For the sky: share of the sky that clouds cover, 0 to 1.
  [[nodiscard]] std::unique_ptr<Texture> make_clouds(double cover) const;
  [[nodiscard]] std::unique_ptr<Texture> make_cloud_detail() const;

 private:
  const Texture* add(Texture texture);
  void weather(Canvas* canvas, std::uint64_t seed, double strength) const;
  void add_ground();
  void add_roads();
  void add_facades();
  void add_walls();
  void add_plants();
  void add_objects();
  Layer detail(double period_m) const;
  // Of several materials of a kind that follow `first`.
  Material& nth(MaterialId first, int i) {
    return materials_[static_cast<std::size_t>(first) + static_cast<std::size_t>(i)];
  }

  std::uint64_t seed_;
  std::vector<std::unique_ptr<Texture>> textures_;
  std::vector<Material> materials_;
  NoiseSheet soft_, rough_;
  const Texture* grain_ = nullptr;  // fine structure that every rough surface has
};

}  // namespace farpoint::tools::simulate
