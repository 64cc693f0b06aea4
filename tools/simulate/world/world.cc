// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/world/world.h"

#include <algorithm>
#include <cmath>

#include "tools/simulate/world/random.h"

namespace farpoint::tools::simulate {
namespace {

constexpr double kNearView_m = 2200.0, kFarView_m = 7000.0;
// Chunks are dropped only this much further away than they are made, so that none is made again and again.
constexpr double kKeepFactor = 1.15;
// An endless road reaches this far beyond what is driven in the time: its end is never seen.
constexpr double kRoadBeyond_m = 3500.0;

Eigen::Vector3d direction_to_sun(const SkyDescription& sky) {
  const double c = std::cos(sky.sun_elevation_rad);
  return {c * std::cos(sky.sun_azimuth_rad), c * std::sin(sky.sun_azimuth_rad),
          std::sin(sky.sun_elevation_rad)};
}

// Corners of a road that keeps its general direction, so that it never meets itself.
std::vector<Eigen::Vector2d> wander(const RoadDescription& road, std::uint64_t seed, double length_m) {
  constexpr double kMaxHeading_rad = 0.9;
  Random random(seed_of(seed, "wander"));
  std::vector<Eigen::Vector2d> corners = {{-400.0, 0.0}, {100.0, 0.0}};
  double heading = 0.0;
  for (double length = 500.0; length < length_m;) {
    const double turn = random.uniform(-road.wander_turn_rad, road.wander_turn_rad);
    heading = std::clamp(heading + turn, -kMaxHeading_rad, kMaxHeading_rad);
    const double straight = road.wander_straight_m * random.uniform(0.5, 1.5);
    corners.emplace_back(corners.back() + straight * Eigen::Vector2d(std::cos(heading), std::sin(heading)));
    length += straight;
  }
  return corners;
}

}  // namespace

World::World(const WorldDescription& description, std::uint64_t seed, double duration_s)
    : description_(description), materials_(seed) {
  site_.world = &description_;
  site_.seed = seed_of(seed, "world");
  site_.to_sun = direction_to_sun(description_.sky);
  clouds_ = materials_.make_clouds(description_.sky.cloud_share);
  cloud_detail_ = materials_.make_cloud_detail();
  make_routes(duration_s);
  terrain_ = std::make_unique<Terrain>(description_.terrain, site_.seed, &roads_);
  site_.terrain = terrain_.get();
  site_.roads = &roads_;
  site_.road = &road_;
}

void World::make_routes(double duration_s) {
  if (description_.road) {
    const RoadDescription& road = *description_.road;
    std::vector<Eigen::Vector2d> corners = road.waypoints_m;
    if (corners.empty()) {
      const double speed = description_.drive ? description_.drive->speed_mps : 0.0;
      corners = wander(road, site_.seed, speed * duration_s + kRoadBeyond_m);
    }
    road_ = Path(corners, road.corner_radius_m, road.closed);
    site_.road_half_width_m = 0.5 * road_width_m(road.surface);
    roads_.add(road_, site_.road_half_width_m);
    route_ = road_;
  }
  if (description_.town) {
    const TownDescription& town = *description_.town;
    const auto street = [&](const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
      site_.streets.emplace_back(std::vector<Eigen::Vector2d>{from, to}, 1.0, false);
      roads_.add(site_.streets.back(), kStreetHalfWidth_m);
    };
    for (const double x : town.columns_m) street({x, town.rows_m.front()}, {x, town.rows_m.back()});
    for (const double y : town.rows_m) street({town.columns_m.front(), y}, {town.columns_m.back(), y});
    if (description_.drive && !description_.drive->street_corners.empty()) {
      std::vector<Eigen::Vector2d> corners;
      for (const Eigen::Vector2i& c : description_.drive->street_corners) {
        corners.emplace_back(town.columns_m[static_cast<std::size_t>(c.x())],
                             town.rows_m[static_cast<std::size_t>(c.y())]);
      }
      route_ = Path(corners, description_.drive->corner_radius_m, true);
    }
  }
  if (description_.yard) {
    const double x = 0.34 * description_.yard->length_m, y = 0.32 * description_.yard->width_m;
    const Path track({{-x, -y}, {x, -y}, {x, y}, {-x, y}}, 0.7 * y, true);
    roads_.add(Path({{-x, 0}, {x, 0}}, 1.0, false), 1.1 * 0.5 * description_.yard->width_m);
    if (route_.empty()) route_ = track;
  }
}

std::unique_ptr<Chunk> World::make_chunk(const Key& key, bool is_near) const {
  const double size = is_near ? kNearChunk_m : kFarChunk_m;
  const double x = static_cast<double>(key.first) * size, y = static_cast<double>(key.second) * size;
  const double to_road = roads_.distance_m(x + 0.5 * size, y + 0.5 * size);
  if (is_near && to_road > kNearGround_m) return nullptr;
  auto chunk = std::make_unique<Chunk>();
  chunk->origin = {x, y, terrain_->height(x + 0.5 * size, y + 0.5 * size)};
  chunk->size_m = size;
  MeshBuilder builder(&chunk->mesh, site_.to_sun, description_.sky.ambient);
  const ChunkSite site{chunk->origin, size, &builder};
  if (is_near) {
    build_near_ground(site_, site);
    build_road(site_, site);
    build_town(site_, site);
    build_yard(site_, site);
    build_wilderness(site_, site);
    chunk->light_map =
        bake_light(site_, site, chunk->mesh, materials_.materials(), to_road < 100.0 ? 256 : 64, 8.0);
  } else {
    build_far_ground(site_, site);
    build_towers(site_, site);
    chunk->light_map = bake_light(site_, site, Mesh{}, materials_.materials(), 128, 16.0);
  }
  return chunk;
}

void World::visit(const Eigen::Vector3d& position, bool is_near, std::vector<const Chunk*>* chunks) {
  const double size = is_near ? kNearChunk_m : kFarChunk_m, view = is_near ? kNearView_m : kFarView_m;
  auto& cache = is_near ? near_ : far_;
  const auto distance = [&](const Key& key) {
    return std::hypot((static_cast<double>(key.first) + 0.5) * size - position.x(),
                      (static_cast<double>(key.second) + 0.5) * size - position.y());
  };
  std::erase_if(cache, [&](const auto& entry) { return distance(entry.first) > kKeepFactor * view; });
  const auto low = [&](double v) { return std::llround(std::floor((v - view) / size)); };
  const auto high = [&](double v) { return std::llround(std::floor((v + view) / size)); };
  for (long long iy = low(position.y()); iy <= high(position.y()); ++iy) {
    for (long long ix = low(position.x()); ix <= high(position.x()); ++ix) {
      const Key key{ix, iy};
      if (distance(key) > view) continue;
      auto found = cache.find(key);
      if (found == cache.end()) found = cache.emplace(key, make_chunk(key, is_near)).first;
      if (found->second) chunks->push_back(found->second.get());
    }
  }
}

Scene World::scene_around(const Eigen::Vector3d& position) {
  Scene scene;
  scene.materials = &materials_.materials();
  visit(position, true, &scene.chunks);
  visit(position, false, &scene.chunks);
  const SkyDescription& sky = description_.sky;
  scene.sky.clouds = clouds_.get();
  scene.sky.cloud_detail = cloud_detail_.get();
  scene.sky.height_m = sky.cloud_height_m;
  scene.sky.wind_mps =
      sky.wind_mps * Eigen::Vector2d(std::cos(sky.wind_direction_rad), std::sin(sky.wind_direction_rad));
  scene.sway_direction = {std::cos(sky.wind_direction_rad), std::sin(sky.wind_direction_rad), 0.0};
  scene.visibility_m = sky.visibility_m;
  return scene;
}

}  // namespace farpoint::tools::simulate
