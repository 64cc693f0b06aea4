// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/simulate/world/materials.h"
#include "tools/simulate/world/props.h"
#include "tools/simulate/world/random.h"
#include "tools/simulate/world/site.h"

namespace farpoint::tools::simulate {
namespace {

constexpr double kRoadLift_m = 0.04;  // above the base of the terrain
constexpr double kMaxPiece_m = 6.0;

struct Edge {
  Path::Place place;
  double s_m;
};

Eigen::Vector3d on_road(const Site& site, const ChunkSite& chunk, const Path::Place& place, double offset_m,
                        double lift_m) {
  const Eigen::Vector2d p = place.position + offset_m * place.left();
  return chunk.local(p.x(), p.y(), site.terrain->base(p.x(), p.y()) + lift_m);
}

void add_strip(const Site& site, const ChunkSite& chunk, const Edge& a, const Edge& b, double right_m,
               double left_m, double lift_right_m, double lift_left_m, const MeshBuilder::Paint& paint,
               double texture_s_m) {
  const Eigen::Vector3d p = on_road(site, chunk, a.place, right_m, lift_right_m);
  const Eigen::Vector3d q = on_road(site, chunk, b.place, right_m, lift_right_m);
  const Eigen::Vector3d r = on_road(site, chunk, b.place, left_m, lift_left_m);
  const Eigen::Vector3d s = on_road(site, chunk, a.place, left_m, lift_left_m);
  // The texture runs across the road from its left edge, and along it. Two triangles: the piece may be bent.
  // From the left edge to the right one is the texture's s; its t then runs along the road.
  const std::size_t period = 24;  // of the road textures, m
  const double t = std::fmod(a.s_m, static_cast<double>(period));
  chunk.builder->quad(s, p, q, r, paint, texture_s_m, t);
}

int material_of(RoadSurface surface) {
  switch (surface) {
    case RoadSurface::kMotorway:
      return kRoadMotorway;
    case RoadSurface::kTrack:
      return kTrack;
    case RoadSurface::kTwoLanes:
      break;
  }
  return kRoadTwoLanes;
}

void add_piece(const Site& site, const ChunkSite& chunk, const Edge& a, const Edge& b) {
  const RoadDescription& road = *site.world->road;
  const double half = site.road_half_width_m;
  const MeshBuilder::Paint surface = ground_paint(material_of(road.surface)), verge = ground_paint(kGravel);
  if (road.surface == RoadSurface::kMotorway) {  // two carriageways with a strip between them
    const double width = 11.0, gap = half - width;
    // Each carriageway's hard shoulder is on its outer side: the left one is laid the other way round.
    add_strip(site, chunk, a, b, -half, -gap, kRoadLift_m, kRoadLift_m, surface, 0.0);
    const Edge back_a{{b.place.position, -b.place.forward, 0}, -b.s_m},
        back_b{{a.place.position, -a.place.forward, 0}, -a.s_m};
    add_strip(site, chunk, {back_a.place, 24.0 - std::fmod(b.s_m, 24.0)}, back_b, -half, -gap, kRoadLift_m,
              kRoadLift_m, surface, 0.0);
    add_strip(site, chunk, a, b, -gap, gap, kRoadLift_m, kRoadLift_m, ground_paint(kGround), 0.0);
  } else {
    add_strip(site, chunk, a, b, -half, half, kRoadLift_m, kRoadLift_m, surface, 0.0);
  }
  add_strip(site, chunk, a, b, half, half + 1.2, kRoadLift_m, 0.02, verge, 0.0);
  add_strip(site, chunk, a, b, -half - 1.2, -half, 0.02, kRoadLift_m, verge, 0.0);
  add_strip(site, chunk, a, b, half + 1.2, half + 5.0, 0.02, -0.6, ground_paint(kGround), 0.0);
  add_strip(site, chunk, a, b, -half - 5.0, -half - 1.2, -0.6, 0.02, ground_paint(kGround), 0.0);
}

void add_rail(const Site& site, const ChunkSite& chunk, const Edge& a, const Edge& b, double offset_m) {
  MeshBuilder::Paint rail;
  rail.material = kMetal;
  rail.two_sided = true;
  const Eigen::Vector3d p = on_road(site, chunk, a.place, offset_m, 0.45),
                        q = on_road(site, chunk, b.place, offset_m, 0.45);
  const Eigen::Vector3d up(0, 0, 0.31);
  chunk.builder->quad(p, q, q + up, p + up, rail, a.s_m, 0.0);
  MeshBuilder::Paint post;
  post.material = kMetal;
  post.brightness = 0.6;
  chunk.builder->box(on_road(site, chunk, a.place, offset_m * 1.01, -0.1), 0.06, 0.06, 0.8, 0, post, post);
}

// Calls add(place, s, random) at about every `every_m` metres of the road, where the place lies in the chunk.
template <typename Add>
void along_road(const Site& site, const ChunkSite& chunk, double every_m, const char* name, const Add& add) {
  if (every_m <= 0.0) return;
  const std::uint64_t seed = seed_of(site.seed, name);
  const auto count = static_cast<std::int64_t>(site.road->length_m() / every_m + 1e-6);
  for (std::int64_t i = 0; i < count; ++i) {
    // A cheap test first: the road may be hundreds of kilometres long.
    const double middle = (static_cast<double>(i) + 0.5) * every_m;
    const Path::Place near_place = site.road->at(middle);
    const Eigen::Vector2d off =
        near_place.position - chunk.origin.head<2>() - Eigen::Vector2d::Constant(0.5 * chunk.size_m);
    if (off.cwiseAbs().maxCoeff() > chunk.size_m + every_m) {
      // The road is no shorter than the straight way to the chunk.
      const double skip = (off.cwiseAbs().maxCoeff() - chunk.size_m - every_m) / every_m;
      i += std::max<std::int64_t>(0, static_cast<std::int64_t>(skip) - 1);
      continue;
    }
    Random random(seed_at(seed, i, 0));
    const double s = middle + random.uniform(-0.35, 0.35) * every_m;
    add(site.road->at(s), s, &random);
  }
}

double heading(const Path::Place& place) {
  return std::atan2(place.forward.y(), place.forward.x());
}

// A spot beside the road where it belongs to the chunk.
template <typename Add>
void beside(const Site& site, const ChunkSite& chunk, const Path::Place& place, double offset_m,
            const Add& add) {
  const Eigen::Vector2d p = place.position + offset_m * place.left();
  if (!chunk.holds(p.x(), p.y())) return;
  const double z = site.terrain->height(p.x(), p.y());
  add(Spot{chunk.local(p.x(), p.y(), z), heading(place)});
}

}  // namespace

double road_width_m(RoadSurface surface) {
  switch (surface) {
    case RoadSurface::kMotorway:
      return 25.0;  // two carriageways of 11 m
    case RoadSurface::kTrack:
      return 4.0;
    case RoadSurface::kTwoLanes:
      break;
  }
  return 8.0;
}

void build_road(const Site& site, const ChunkSite& chunk) {
  if (site.road == nullptr || site.road->empty()) return;
  const RoadDescription& road = *site.world->road;
  const double half = site.road_half_width_m;
  chunk.builder->begin_cluster();
  int pieces = 0;
  const double piece_m = site.road->length_m() / std::ceil(site.road->length_m() / kMaxPiece_m);
  along_road(site, chunk, piece_m, "pieces", [&](const Path::Place&, double s, Random*) {
    const double begin = std::floor(s / piece_m) * piece_m;
    const Path::Place middle = site.road->at(begin + 0.5 * piece_m);
    if (!chunk.holds(middle.position.x(), middle.position.y())) return;
    const int parts = std::abs(middle.curvature) > 0.02 ? 4 : 1;
    for (int i = 0; i < parts; ++i) {
      const double s0 = begin + piece_m * i / parts, s1 = begin + piece_m * (i + 1) / parts;
      const Edge a{site.road->at(s0), s0}, b{site.road->at(s1), s1};
      add_piece(site, chunk, a, b);
      if (!road.guard_rails) continue;
      add_rail(site, chunk, a, b, half + 0.9);
      add_rail(site, chunk, a, b, -half - 0.9);
      if (road.surface == RoadSurface::kMotorway) add_rail(site, chunk, a, b, 0.0);
    }
    if (++pieces % 4 == 0) {
      chunk.builder->end_cluster();
      chunk.builder->begin_cluster();
    }
  });
  chunk.builder->end_cluster();
  along_road(site, chunk, road.post_every_m, "posts", [&](const Path::Place& place, double, Random* random) {
    for (const double side : {-1.0, 1.0}) {
      beside(site, chunk, place, side * (half + 0.6), [&](const Spot& spot) {
        add_box(chunk.builder, spot, {0.12, 0.12, 1.05}, kKerb, random->uniform(1.2, 1.7));
      });
    }
  });
  along_road(site, chunk, road.tree_every_m, "trees", [&](const Path::Place& place, double, Random* random) {
    const double side = random->chance(0.5) ? 1.0 : -1.0, offset = half + random->uniform(3.5, 22.0);
    beside(site, chunk, place, side * offset, [&](const Spot& spot) {
      if (random->chance(0.3)) {
        add_bush(chunk.builder, spot, random->uniform(0.6, 1.6), random);
      } else {
        add_tree(chunk.builder, spot, random->uniform(5.0, 13.0), TreeDetail::kNear, random);
      }
    });
  });
  along_road(site, chunk, road.sign_every_m, "signs", [&](const Path::Place& place, double, Random* random) {
    const double offset = -half - 1.6, size = random->uniform(0.7, 1.6);
    beside(site, chunk, place, offset,
           [&](const Spot& spot) { add_sign(chunk.builder, spot, size, random->uniform(1.2, 2.2), random); });
  });
  along_road(site, chunk, road.gantry_every_m, "gantries",
             [&](const Path::Place& place, double, Random* random) {
               beside(site, chunk, place, 0.0,
                      [&](const Spot& spot) { add_gantry(chunk.builder, spot, half + 1.8, random); });
             });
  along_road(
      site, chunk, road.house_every_m, "houses", [&](const Path::Place& place, double, Random* random) {
        const double side = random->chance(0.5) ? 1.0 : -1.0, offset = half + random->uniform(9.0, 45.0);
        const double turn = random->uniform(-0.2, 0.2);
        beside(site, chunk, place, side * offset, [&](const Spot& spot) {
          // Houses face the road.
          const double yaw = side > 0 ? turn : std::numbers::pi + turn;
          const HouseSize size{random->uniform(9.0, 15.0), random->uniform(8.0, 11.0), random->index(2),
                               false, true};
          add_house(chunk.builder, spot.moved(0, 0, 0, yaw), size, random);
        });
      });
}

}  // namespace farpoint::tools::simulate
