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

constexpr double kPi = std::numbers::pi;
constexpr double kStreetLift_m = 0.04, kPavementLift_m = 0.17;
constexpr double kPiece_m = 8.0;

// Draws rectangles of the town's ground, axis-parallel in the world.
class Flats {
 public:
  Flats(const Site& site, const ChunkSite& chunk) : site_(site), chunk_(chunk) {}

  [[nodiscard]] Eigen::Vector3d point(double x, double y, double lift_m) const {
    return chunk_.local(x, y, site_.terrain->base(x, y) + lift_m);
  }
  // s of the texture runs along x, or along y where `turned`.
  void rectangle(double x0, double y0, double x1, double y1, double lift_m, const MeshBuilder::Paint& paint,
                 bool turned, double s_m, double t_m) const {
    const Eigen::Vector3d a = point(x0, y0, lift_m), b = point(x1, y0, lift_m), c = point(x1, y1, lift_m),
                          d = point(x0, y1, lift_m);
    turned ? chunk_.builder->quad(b, c, d, a, paint, s_m, t_m)
           : chunk_.builder->quad(a, b, c, d, paint, s_m, t_m);
  }
  // A wall on the ground from one point to another, seen from its right.
  void wall(double x0, double y0, double x1, double y1, double low_m, double high_m,
            const MeshBuilder::Paint& paint) const {
    chunk_.builder->quad(point(x0, y0, low_m), point(x1, y1, low_m), point(x1, y1, high_m),
                         point(x0, y0, high_m), paint);
  }
  [[nodiscard]] Spot spot(double x, double y, double yaw_rad, double lift_m) const {
    return {point(x, y, lift_m), yaw_rad};
  }

 private:
  const Site& site_;
  const ChunkSite& chunk_;
};

struct Block {
  double x0, y0, x1, y1;  // edges of the streets around it
  std::uint64_t seed;
};

// One side of a block: its start, direction and length; the street is to its right.
struct Side {
  Eigen::Vector2d start, along;
  double length_m;
  [[nodiscard]] Eigen::Vector2d inward() const { return {-along.y(), along.x()}; }
  [[nodiscard]] Eigen::Vector2d at(double s, double in) const { return start + s * along + in * inward(); }
  [[nodiscard]] double yaw() const { return std::atan2(along.y(), along.x()); }
};

std::array<Side, 4> sides_of(const Block& block) {
  const double w = block.x1 - block.x0, h = block.y1 - block.y0;
  return {Side{{block.x0, block.y0}, {1, 0}, w}, Side{{block.x1, block.y0}, {0, 1}, h},
          Side{{block.x1, block.y1}, {-1, 0}, w}, Side{{block.x0, block.y1}, {0, -1}, h}};
}

void add_street_pieces(const Site& site, const ChunkSite& chunk) {
  const TownDescription& town = *site.world->town;
  const Flats flats(site, chunk);
  const MeshBuilder::Paint road = ground_paint(kRoadTwoLanes), crossing = ground_paint(kAsphalt);
  constexpr double kHalf = kStreetHalfWidth_m;
  const auto pieces = [&](const std::vector<double>& along, double across, bool vertical) {
    for (std::size_t i = 0; i + 1 < along.size(); ++i) {
      const double begin = along[i] + kHalf, end = along[i + 1] - kHalf;
      const int count = std::max(1, static_cast<int>(std::ceil((end - begin) / kPiece_m)));
      chunk.builder->begin_cluster();
      for (int k = 0; k < count; ++k) {
        const double a = begin + (end - begin) * k / count, b = begin + (end - begin) * (k + 1) / count;
        const double middle = 0.5 * (a + b);
        if (!(vertical ? chunk.holds(across, middle) : chunk.holds(middle, across))) continue;
        const double t = std::fmod(a - begin, 24.0);
        if (vertical) {
          flats.rectangle(across - kHalf, a, across + kHalf, b, kStreetLift_m, road, false, 0.0, t);
        } else {
          flats.rectangle(a, across - kHalf, b, across + kHalf, kStreetLift_m, road, true, 0.0,
                          24.0 - std::fmod(b - begin, 24.0));
        }
      }
      chunk.builder->end_cluster();
    }
  };
  for (const double x : town.columns_m) pieces(town.rows_m, x, true);
  for (const double y : town.rows_m) pieces(town.columns_m, y, false);
  for (const double x : town.columns_m) {
    for (const double y : town.rows_m) {
      if (!chunk.holds(x, y)) continue;
      chunk.builder->begin_cluster();
      flats.rectangle(x - kHalf, y - kHalf, x + kHalf, y + kHalf, kStreetLift_m, crossing, false,
                      std::fmod(x, 16.0), std::fmod(y, 24.0));
      MeshBuilder::Paint stripe = ground_paint(kKerb);
      stripe.brightness = 1.3;
      for (const double side : {-1.0, 1.0}) {  // zebra crossings on two of the four arms
        for (int i = 0; i < 7; ++i) {
          const double at = -kHalf + 0.6 + 1.1 * i, from = kHalf + 1.0, to = kHalf + 3.6;
          if (side > 0) {
            flats.rectangle(x + at, y + from, x + at + 0.5, y + to, kStreetLift_m + 0.012, stripe, true, 0,
                            0);
          } else {
            flats.rectangle(x - to, y + at, x - from, y + at + 0.5, kStreetLift_m + 0.012, stripe, false, 0,
                            0);
          }
        }
      }
      chunk.builder->end_cluster();
    }
  }
}

// Pavement and kerb along a side of a block.
void add_pavement(const Site& site, const ChunkSite& chunk, const Side& side, double width_m) {
  const Flats flats(site, chunk);
  const MeshBuilder::Paint slabs = ground_paint(kPavement), skirt = ground_paint(kConcrete);
  MeshBuilder::Paint kerb;
  kerb.material = kKerb;
  const int count = std::max(1, static_cast<int>(std::ceil(side.length_m / kPiece_m)));
  chunk.builder->begin_cluster();
  for (int i = 0; i < count; ++i) {
    const double a = side.length_m * i / count, b = side.length_m * (i + 1) / count;
    const Eigen::Vector2d middle = side.at(0.5 * (a + b), 0.5 * width_m);
    if (!chunk.holds(middle.x(), middle.y())) continue;
    const Eigen::Vector2d p = side.at(a, 0), q = side.at(b, 0), r = side.at(b, width_m),
                          s = side.at(a, width_m);
    chunk.builder->quad(flats.point(p.x(), p.y(), kPavementLift_m),
                        flats.point(q.x(), q.y(), kPavementLift_m),
                        flats.point(r.x(), r.y(), kPavementLift_m),
                        flats.point(s.x(), s.y(), kPavementLift_m), slabs, a, 0.0);
    flats.wall(p.x(), p.y(), q.x(), q.y(), -0.2, kPavementLift_m, kerb);
    flats.wall(r.x(), r.y(), s.x(), s.y(), -1.0, kPavementLift_m, skirt);
  }
  chunk.builder->end_cluster();
}

void add_street_furniture(const Site& site, const ChunkSite& chunk, const Side& side, std::uint64_t seed) {
  const TownDescription& town = *site.world->town;
  const Flats flats(site, chunk);
  const auto along = [&](double every_m, const char* name, double in_m, double keep_clear_m,
                         const auto& add) {
    if (every_m <= 0.0) return;
    Random random(seed_of(seed, name));
    for (double s = keep_clear_m + random.uniform(0.0, every_m); s < side.length_m - keep_clear_m;
         s += every_m * random.uniform(0.85, 1.15)) {
      Random one(random.bits());
      const Eigen::Vector2d p = side.at(s, in_m);
      if (chunk.holds(p.x(), p.y())) add(flats.spot(p.x(), p.y(), side.yaw(), kPavementLift_m), &one);
    }
  };
  const bool has_trees = Random(seed_of(seed, "avenue")).chance(0.6);
  if (has_trees) {
    along(town.tree_every_m, "trees", 0.6, 9.0, [&](const Spot& spot, Random* random) {
      add_tree(chunk.builder, spot, random->uniform(5.5, 9.0), TreeDetail::kNear, random);
    });
  }
  along(town.lamp_every_m, "lamps", 0.4, 5.0, [&](const Spot& spot, Random*) {
    add_lamp(chunk.builder, spot.moved(0, 0, 0, -0.5 * kPi), 7.0, 1.6);
  });
  along(town.sign_every_m, "signs", 0.35, 5.0, [&](const Spot& spot, Random* random) {
    add_sign(chunk.builder, spot, random->uniform(0.5, 0.9), 2.1, random);
  });
  along(23.0, "bins", 0.5, 7.0, [&](const Spot& spot, Random* random) {
    const double w = random->uniform(0.4, 1.2);
    const int material = random->chance(0.5) ? static_cast<int>(kMetal) : kFirstSign + random->index(kSigns);
    add_box(chunk.builder, spot, {w, 0.5, random->uniform(0.8, 1.6)}, material, random->uniform(0.3, 1.0));
  });
  Random random(seed_of(seed, "parked"));
  for (double s = 10.0; s < side.length_m - 12.0; s += random.uniform(5.6, 6.8)) {
    const bool occupied = random.chance(town.parked_cars_share);
    const double paint = random.uniform(0.2, 1.6), out = random.uniform(0.35, 0.6),
                 turn = random.uniform(-0.02, 0.02);
    const Eigen::Vector2d p = side.at(s, out);
    if (!occupied || !chunk.holds(p.x(), p.y())) continue;
    add_car(chunk.builder, flats.spot(p.x(), p.y(), side.yaw() + turn, 0.06), paint);
  }
}

void add_houses(const Site& site, const ChunkSite& chunk, const Block& block) {
  const TownDescription& town = *site.world->town;
  const Flats flats(site, chunk);
  const double inset = town.pavement_m;
  const auto sides = sides_of({block.x0 + inset, block.y0 + inset, block.x1 - inset, block.y1 - inset, 0});
  constexpr double kDepth = 12.0;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const Side& side = sides[i];
    Random random(seed_at(block.seed, static_cast<std::int64_t>(i), 1));
    // The corner belongs to the side that starts there; the next one keeps its depth off.
    double s = 0.0;
    const double end = side.length_m - kDepth;
    while (end - s > 6.0) {
      double width = random.uniform(10.0, 21.0);
      if (end - s - width < 9.0) width = end - s;
      Random one(random.bits());
      const bool gap = random.chance(0.07) && s > 1.0;
      const HouseSize size{
          width, kDepth * random.uniform(0.8, 1.0),
          town.min_floors - 1 + random.index(std::max(1, town.max_floors - town.min_floors + 1)),
          random.chance(0.65), false};
      const double back =
          random.chance(0.25) ? random.uniform(0.0, 2.5) : 0.0;  // some stand back from the line
      const Eigen::Vector2d p = side.at(s, s < 1.0 ? 0.0 : back),
                            middle = side.at(s + 0.5 * width, 0.5 * kDepth);
      s += width;
      if (!chunk.holds(middle.x(), middle.y())) continue;
      const Spot spot = flats.spot(p.x(), p.y(), side.yaw(), 0.0);
      if (!gap) {
        add_house(chunk.builder, spot, size, &one);
        continue;
      }
      add_box(chunk.builder, spot.moved(0.5 * width, 0.3, -0.3), {width, 0.3, 2.0}, kBrickWall, 1.0);
      add_tree(chunk.builder, spot.moved(0.5 * width, 5.0, 0), one.uniform(7.0, 11.0), TreeDetail::kNear,
               &one);
    }
  }
  // The court.
  Random random(seed_at(block.seed, 7, 7));
  for (int i = 0; i < 10; ++i) {
    const double x = random.uniform(block.x0 + 22, block.x1 - 22),
                 y = random.uniform(block.y0 + 22, block.y1 - 22);
    Random one(random.bits());
    if (x > block.x1 - 20 || y > block.y1 - 20 || !chunk.holds(x, y)) continue;
    add_tree(chunk.builder, flats.spot(x, y, 0, 0), one.uniform(6.0, 14.0), TreeDetail::kFar, &one);
  }
}

void add_park(const Site& site, const ChunkSite& chunk, const Block& block) {
  const Flats flats(site, chunk);
  const double inset = site.world->town->pavement_m + 0.4;
  for (const Side& side :
       sides_of({block.x0 + inset, block.y0 + inset, block.x1 - inset, block.y1 - inset, 0})) {
    for (double s = 0.0; s < side.length_m - 8.0; s += 4.0) {
      const Eigen::Vector2d p = side.at(s + 2.0, 0.3);
      if (!chunk.holds(p.x(), p.y())) continue;
      add_box(chunk.builder, flats.spot(p.x(), p.y(), side.yaw(), -0.4), {4.0, 0.8, 1.5}, kHedge, 1.0);
    }
  }
  Random random(seed_at(block.seed, 3, 3));
  const auto count = static_cast<int>((block.x1 - block.x0) * (block.y1 - block.y0) / 90.0);
  for (int i = 0; i < count; ++i) {
    const double x = random.uniform(block.x0 + 6, block.x1 - 6),
                 y = random.uniform(block.y0 + 6, block.y1 - 6);
    Random one(random.bits());
    if (!chunk.holds(x, y)) continue;
    const double z = site.terrain->height(x, y);
    const Spot spot{chunk.local(x, y, z), one.uniform(0.0, kPi)};
    one.chance(0.25) ? add_bush(chunk.builder, spot, one.uniform(0.6, 1.4), &one)
                     : add_tree(chunk.builder, spot, one.uniform(6.0, 15.0), TreeDetail::kNear, &one);
  }
}

}  // namespace

void build_town(const Site& site, const ChunkSite& chunk) {
  if (!site.world->town) return;
  const TownDescription& town = *site.world->town;
  add_street_pieces(site, chunk);
  const std::uint64_t seed = seed_of(site.seed, "blocks");
  for (std::size_t c = 0; c + 1 < town.columns_m.size(); ++c) {
    for (std::size_t r = 0; r + 1 < town.rows_m.size(); ++r) {
      const Block block{town.columns_m[c] + kStreetHalfWidth_m, town.rows_m[r] + kStreetHalfWidth_m,
                        town.columns_m[c + 1] - kStreetHalfWidth_m, town.rows_m[r + 1] - kStreetHalfWidth_m,
                        seed_at(seed, static_cast<std::int64_t>(c), static_cast<std::int64_t>(r))};
      const bool touches = block.x1 > chunk.origin.x() && block.y1 > chunk.origin.y() &&
                           block.x0 < chunk.origin.x() + chunk.size_m &&
                           block.y0 < chunk.origin.y() + chunk.size_m;
      if (!touches) continue;
      const auto sides = sides_of(block);
      for (std::size_t i = 0; i < sides.size(); ++i) {
        add_pavement(site, chunk, sides[i], town.pavement_m);
        add_street_furniture(site, chunk, sides[i], seed_at(block.seed, static_cast<std::int64_t>(i), 2));
      }
      Random(block.seed).chance(town.park_share) ? add_park(site, chunk, block)
                                                 : add_houses(site, chunk, block);
    }
  }
}

void build_yard(const Site& site, const ChunkSite& chunk) {
  if (!site.world->yard) return;
  const YardDescription& yard = *site.world->yard;
  const Flats flats(site, chunk);
  const double half_x = 0.5 * yard.length_m, half_y = 0.5 * yard.width_m;
  // The paving, in squares.
  const int nx = static_cast<int>(std::ceil(yard.length_m / kPiece_m)),
            ny = static_cast<int>(std::ceil(yard.width_m / kPiece_m));
  chunk.builder->begin_cluster();
  for (int iy = 0; iy < ny; ++iy) {
    for (int ix = 0; ix < nx; ++ix) {
      const double x0 = -half_x + yard.length_m * ix / nx, x1 = -half_x + yard.length_m * (ix + 1) / nx;
      const double y0 = -half_y + yard.width_m * iy / ny, y1 = -half_y + yard.width_m * (iy + 1) / ny;
      if (!chunk.holds(0.5 * (x0 + x1), 0.5 * (y0 + y1))) continue;
      flats.rectangle(x0, y0, x1, y1, kStreetLift_m, ground_paint((ix + iy) % 3 == 0 ? kAsphalt : kPavement),
                      false, x0 + half_x, y0 + half_y);
    }
  }
  chunk.builder->end_cluster();
  Random random(seed_of(site.seed, "yard"));
  const auto sides = sides_of({-half_x, -half_y, half_x, half_y, 0});
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const Side& side = sides[i];
    for (double s = 0.0; s < side.length_m - 3.0;) {
      const double width = std::min(random.uniform(8.0, 16.0), side.length_m - s);
      Random one(random.bits());
      const bool house = random.chance(0.6);
      const Eigen::Vector2d p = side.at(s + (house ? width : 0.5 * width), -0.4);
      s += width;
      if (!chunk.holds(p.x(), p.y())) continue;
      // Fronts face the yard.
      if (house) {
        add_house(chunk.builder, flats.spot(p.x(), p.y(), side.yaw() + kPi, 0.0),
                  {width, 9.0, 1 + one.index(3), one.chance(0.7), false}, &one);
      } else {
        add_box(chunk.builder, flats.spot(p.x(), p.y(), side.yaw(), -0.5),
                {width, 0.3, one.uniform(2.2, 3.5)}, kBrickWall, one.uniform(0.8, 1.2));
      }
    }
  }
  const auto place = [&](double width, double length, const auto& add) {
    // Things stand in a ring between the track and the walls, or in the middle.
    Random one(random.bits());
    const bool middle = random.chance(0.4);
    const double u = random.uniform(-1.0, 1.0), v = random.uniform(-1.0, 1.0);
    double x = u * 0.28 * half_x, y = v * 0.22 * half_y;
    if (!middle) {
      const bool on_x = random.chance(0.5);
      x = on_x ? u * (half_x - length) : std::copysign(half_x - 0.6 * length - 0.5, u);
      y = on_x ? std::copysign(half_y - 0.6 * width - 0.5, v) : v * (half_y - width);
    }
    if (chunk.holds(x, y))
      add(flats.spot(x, y, one.uniform(-0.15, 0.15) + (one.chance(0.5) ? 0.0 : 0.5 * kPi), kStreetLift_m),
          &one);
  };
  for (int i = 0; i < yard.containers; ++i) {
    place(2.6, 2.6, [&](const Spot& spot, Random* one) {
      add_box(chunk.builder, spot, {one->chance(0.5) ? 6.0 : 3.0, 2.4, 2.6}, kContainer,
              one->uniform(0.5, 1.6));
    });
  }
  for (int i = 0; i < yard.crates; ++i) {
    place(1.0, 1.0, [&](const Spot& spot, Random* one) {
      const double w = one->uniform(0.4, 1.3);
      const int material = one->chance(0.4)   ? static_cast<int>(kContainer)
                           : one->chance(0.5) ? kFirstSign + one->index(kSigns)
                                              : static_cast<int>(kBark);
      add_box(chunk.builder, spot, {w, one->uniform(0.4, 1.2), one->uniform(0.4, 1.4)}, material,
              one->uniform(0.6, 1.5));
    });
  }
}

void build_wilderness(const Site& site, const ChunkSite& chunk) {
  const TerrainDescription& d = site.world->terrain;
  Random random(seed_at(seed_of(site.seed, "wilderness"), std::llround(chunk.origin.x()),
                        std::llround(chunk.origin.y())));
  const double hectares = chunk.size_m * chunk.size_m / 1e4;
  const auto strew = [&](double per_hectare, const auto& add) {
    const int count = static_cast<int>(per_hectare * hectares + random.uniform());
    for (int i = 0; i < count; ++i) {
      const double x = chunk.origin.x() + random.uniform() * chunk.size_m,
                   y = chunk.origin.y() + random.uniform() * chunk.size_m;
      Random one(random.bits());
      const double distance = site.roads->distance_m(x, y);
      const double z = site.terrain->height(x, y, distance);
      add(x, y, z, distance, &one);
    }
  };
  strew(d.trees_per_hectare, [&](double x, double y, double z, double distance, Random* one) {
    if (distance < 4.0 || distance > 260.0 || site.world->town) return;
    const Spot spot{chunk.local(x, y, z), one->uniform(0.0, kPi)};
    if (one->chance(0.25)) {
      add_bush(chunk.builder, spot, one->uniform(0.6, 1.8), one);
    } else {
      add_tree(chunk.builder, spot, one->uniform(5.0, 14.0),
               distance < 60.0 ? TreeDetail::kNear : TreeDetail::kFar, one);
    }
  });
  strew(d.rocks_per_hectare, [&](double x, double y, double z, double distance, Random* one) {
    if (distance < 2.5 || distance > 120.0) return;
    add_rock(chunk.builder, {chunk.local(x, y, z), one->uniform(0.0, kPi)},
             0.3 + 1.4 * std::pow(one->uniform(), 3.0), one);
  });
  // Woods: a tree wherever the ground says forest.
  strew(30.0, [&](double x, double y, double z, double distance, Random* one) {
    if (site.terrain->material(x, y, z, 0.0, distance) != kForest) return;
    add_tree(chunk.builder, {chunk.local(x, y, z - 0.5), one->uniform(0.0, kPi)}, one->uniform(8.0, 16.0),
             TreeDetail::kFar, one);
  });
}

void build_towers(const Site& site, const ChunkSite& chunk) {
  const TowersDescription& towers = site.world->towers;
  Random random(seed_of(site.seed, "towers"));
  for (int i = 0; i < towers.count; ++i) {
    Random one(random.bits());
    const double angle = 2.0 * kPi * (i + random.uniform(0.0, 0.7)) / towers.count;
    const double reach = random.uniform(towers.from_m, towers.to_m);
    const double height = random.uniform(towers.min_height_m, towers.max_height_m);
    Eigen::Vector2d p(reach * std::cos(angle), reach * std::sin(angle));
    // Strung along a long road rather than around the middle of the world.
    if (site.road != nullptr && !site.road->empty() && !site.road->closed()) {
      const Path::Place place = site.road->at(site.road->length_m() * (i + 0.5) / towers.count);
      p = place.position + (one.chance(0.5) ? reach : -reach) * place.left();
    }
    if (!chunk.holds(p.x(), p.y())) continue;
    add_tower(chunk.builder,
              {chunk.local(p.x(), p.y(), site.terrain->height(p.x(), p.y())), one.uniform(0.0, kPi)}, height,
              &one);
  }
}

}  // namespace farpoint::tools::simulate
