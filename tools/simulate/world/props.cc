// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/world/props.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/simulate/world/materials.h"

namespace farpoint::tools::simulate {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kFloor_m = 3.2, kGroundFloor_m = 3.6;
// Houses reach below the ground where it slopes.
constexpr double kFoundation_m = 1.5;

using Paint = MeshBuilder::Paint;

// A picture of foliage standing in the world: `across` and `up` are its half sides. It shows the whole
// texture.
void add_card(MeshBuilder* builder, const Eigen::Vector3d& centre, const Eigen::Vector3d& across,
              const Eigen::Vector3d& up, const Paint& paint) {
  constexpr double kTexture_m = 4.0;
  Paint scaled = paint;
  scaled.texture_scale = kTexture_m / (2.0 * across.norm());
  builder->quad(centre - across - up, centre + across - up, centre + across + up, centre - across + up,
                scaled);
}

// A post with square section.
void add_post(MeshBuilder* builder, const Eigen::Vector3d& base, double height_m, double thickness_m,
              int material, double paint) {
  Paint sides;
  sides.material = material;
  sides.brightness = paint;
  builder->box(base, 0.5 * thickness_m, 0.5 * thickness_m, height_m, 0.3, sides, sides);
}

}  // namespace

void add_tree(MeshBuilder* builder, const Spot& spot, double height_m, TreeDetail detail, Random* random) {
  const double trunk = (detail == TreeDetail::kNear ? 0.32 : 0.15) * height_m;
  const double crown = 0.5 * (height_m - trunk);  // half its height
  const Eigen::Vector3d middle = spot.base + Eigen::Vector3d(0, 0, trunk + 0.92 * crown);
  const double tone = random->uniform(0.65, 1.15);
  const double phase = random->uniform(0.0, 2 * kPi);
  builder->begin_cluster();
  add_post(builder, spot.base - Eigen::Vector3d(0, 0, 0.3), trunk + 0.8 * crown, 0.05 * height_m, kBark,
           tone);
  builder->end_cluster();
  builder->begin_cluster();
  Paint paint;
  paint.material = kFirstFoliage + random->index(kFoliages);
  paint.two_sided = true;
  const int cards = detail == TreeDetail::kNear ? 13 : 3;
  for (int i = 0; i < cards; ++i) {
    Eigen::Vector3d centre = middle;
    double size = crown;
    if (detail == TreeDetail::kNear) {
      // Cards of the texture's own size all over the crown, none of them alike.
      const double around = 2 * kPi * (i + random->uniform(0.0, 0.8)) / cards * 2.6,
                   up = random->uniform(-0.75, 0.8);
      const double out = 0.55 * std::sqrt(1.0 - up * up) * crown * 0.8;
      centre += Eigen::Vector3d(out * std::cos(around), out * std::sin(around), up * crown * 0.75);
      size = std::min(2.3, 0.7 * crown);
    }
    const double yaw =
        kPi * (i + random->uniform(0.0, 0.7)) / cards * (detail == TreeDetail::kNear ? 5.0 : 1.0);
    const double lean = detail == TreeDetail::kNear ? random->uniform(-0.5, 0.5) : 0.0;
    const Eigen::Vector3d across(std::cos(yaw), std::sin(yaw), 0);
    const Eigen::Vector3d up(-std::sin(yaw) * std::sin(lean), std::cos(yaw) * std::sin(lean), std::cos(lean));
    paint.brightness = tone * random->uniform(0.75, 1.1);
    paint.fixed_light = std::clamp(0.72 + 0.25 * (centre.z() - middle.z()) / crown, 0.4, 1.0);
    add_card(builder, centre, size * across, size * up, paint);
  }
  builder->end_cluster(0.012 * height_m, phase);
}

void add_bush(MeshBuilder* builder, const Spot& spot, double size_m, Random* random) {
  builder->begin_cluster();
  Paint paint;
  paint.material = kFirstFoliage + random->index(kFoliages);
  paint.two_sided = true;
  paint.fixed_light = 0.75;
  for (int i = 0; i < 4; ++i) {
    const double yaw = spot.yaw_rad + kPi * i / 4 + random->uniform(0.0, 0.4);
    paint.brightness = random->uniform(0.6, 1.1);
    add_card(
        builder,
        spot.base + Eigen::Vector3d(random->uniform(-0.3, 0.3), random->uniform(-0.3, 0.3), 0.85) * size_m,
        size_m * Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0), Eigen::Vector3d(0, 0, size_m), paint);
  }
  builder->end_cluster(0.02 * size_m, random->uniform(0.0, 6.0));
}

void add_rock(MeshBuilder* builder, const Spot& spot, double size_m, Random* random) {
  // An irregular double pyramid: six corners around, one on top.
  builder->begin_cluster();
  Paint paint;
  paint.material = kStone;
  paint.brightness = random->uniform(0.7, 1.2);
  Eigen::Vector3d ring[6];
  for (int i = 0; i < 6; ++i) {
    const double angle = spot.yaw_rad + kPi / 3 * i, reach = size_m * random->uniform(0.7, 1.15);
    ring[i] = spot.base + Eigen::Vector3d(reach * std::cos(angle), reach * std::sin(angle),
                                          size_m * random->uniform(0.1, 0.5));
  }
  const Eigen::Vector3d top =
      spot.base + Eigen::Vector3d(0.2 * random->normal(), 0.2 * random->normal(), 1.0) *
                      (size_m * random->uniform(0.6, 1.1));
  for (int i = 0; i < 6; ++i) {
    const Eigen::Vector3d &a = ring[i], &b = ring[(i + 1) % 6];
    builder->triangle(a, b, top, paint, random->uniform(0, 6), random->uniform(0, 6));
    const Eigen::Vector3d down(0, 0, -size_m);
    builder->triangle(a + down, b, a, paint, i, 2);
    builder->triangle(a + down, b + down, b, paint, i, 4);
  }
  builder->end_cluster();
}

namespace {

void add_gable(MeshBuilder* builder, const Spot& spot, const HouseSize& size, double eaves_m,
               const Paint& wall, double tone) {
  const double rise = 0.32 * size.depth_m, w = size.width_m, d = size.depth_m, over = 0.4;
  Paint roof;
  roof.material = kRoofTiles;
  roof.brightness = tone;
  const double low = eaves_m - over * rise / (0.5 * d);
  builder->quad(spot.at(-over, -over, low), spot.at(w + over, -over, low),
                spot.at(w + over, 0.5 * d, eaves_m + rise), spot.at(-over, 0.5 * d, eaves_m + rise), roof);
  builder->quad(spot.at(w + over, d + over, low), spot.at(-over, d + over, low),
                spot.at(-over, 0.5 * d, eaves_m + rise), spot.at(w + over, 0.5 * d, eaves_m + rise), roof);
  builder->triangle(spot.at(w, 0, eaves_m), spot.at(w, d, eaves_m), spot.at(w, 0.5 * d, eaves_m + rise), wall,
                    0.3, 0.2);
  builder->triangle(spot.at(0, d, eaves_m), spot.at(0, 0, eaves_m), spot.at(0, 0.5 * d, eaves_m + rise), wall,
                    0.3, 0.2);
}

void add_flat_roof(MeshBuilder* builder, const Spot& spot, const HouseSize& size, double top_m,
                   Random* random) {
  const double w = size.width_m, d = size.depth_m;
  Paint roof, rim, box;
  roof.material = kRoofFlat;
  rim.material = kConcrete;
  rim.brightness = 1.2;
  box.material = kConcrete;
  builder->quad(spot.at(0, 0, top_m), spot.at(w, 0, top_m), spot.at(w, d, top_m), spot.at(0, d, top_m), roof,
                random->uniform(0, 16), random->uniform(0, 16));
  // A cornice that stands out, and things on the roof.
  const double e = 0.35, h = 0.5;
  builder->quad(spot.at(-e, -e, top_m - h), spot.at(w + e, -e, top_m - h), spot.at(w + e, -e, top_m + 0.1),
                spot.at(-e, -e, top_m + 0.1), rim);
  builder->quad(spot.at(w + e, d + e, top_m - h), spot.at(-e, d + e, top_m - h),
                spot.at(-e, d + e, top_m + 0.1), spot.at(w + e, d + e, top_m + 0.1), rim);
  builder->quad(spot.at(-e, -e, top_m - h), spot.at(-e, 0, top_m - h), spot.at(w + e, 0, top_m - h),
                spot.at(w + e, -e, top_m - h), rim);
  const int things = random->index(3);
  for (int i = 0; i < things; ++i) {
    box.brightness = random->uniform(0.5, 1.3);
    builder->box(spot.at(random->uniform(0.2, 0.8) * w, random->uniform(0.3, 0.8) * d, top_m),
                 random->uniform(0.5, 1.8), random->uniform(0.5, 1.5), random->uniform(0.8, 2.6),
                 spot.yaw_rad, box, box);
  }
}

}  // namespace

void add_house(MeshBuilder* builder, const Spot& spot, const HouseSize& size, Random* random) {
  const double w = size.width_m, d = size.depth_m;
  const double upper = size.floors * kFloor_m, eaves = kGroundFloor_m + upper;
  Paint wall, ground;
  wall.material = kFirstFacade + random->index(kFacades);
  wall.brightness = random->uniform(0.7, 1.25);
  ground.material = size.has_shop ? kFirstShop + random->index(kShops) : wall.material;
  ground.brightness = wall.brightness * (size.has_shop ? 1.0 : 0.9);
  // Windows keep their places on the front: whole columns of the texture where the house is wide enough.
  const double s = 3.0 * random->index(4);
  builder->begin_cluster();
  const auto side = [&](double x0, double y0, double x1, double y1) {
    builder->quad(spot.at(x0, y0, -kFoundation_m), spot.at(x1, y1, -kFoundation_m),
                  spot.at(x1, y1, kGroundFloor_m), spot.at(x0, y0, kGroundFloor_m), ground, s,
                  size.has_shop ? -kFoundation_m : 9.6 - kFoundation_m - 0.4);
    builder->quad(spot.at(x0, y0, kGroundFloor_m), spot.at(x1, y1, kGroundFloor_m), spot.at(x1, y1, eaves),
                  spot.at(x0, y0, eaves), wall, s, 0.0);
  };
  side(0, 0, w, 0);
  side(w, 0, w, d);
  side(w, d, 0, d);
  side(0, d, 0, 0);
  const double tone = random->uniform(0.7, 1.5);
  if (size.detached || random->chance(0.4)) {
    add_gable(builder, spot, size, eaves, wall, tone);
    Paint chimney;
    chimney.material = kBrickWall;
    builder->box(spot.at(random->uniform(0.2, 0.8) * w, 0.38 * d, eaves), 0.4, 0.4, 0.3 * d + 1.2,
                 spot.yaw_rad, chimney, chimney);
  } else {
    add_flat_roof(builder, spot, size, eaves, random);
  }
  if (size.floors > 1 && random->chance(0.35)) {  // balconies, or a bay
    Paint slab;
    slab.material = kConcrete;
    slab.brightness = 1.2;
    const double x = random->uniform(0.25, 0.75) * w, out = random->uniform(0.8, 1.3);
    for (int floor = 0; floor < size.floors; ++floor) {
      const double z = kGroundFloor_m + floor * kFloor_m;
      builder->box(spot.at(x, -0.5 * out, z), 1.6, 0.5 * out, 1.0, spot.yaw_rad, slab, slab);
      builder->quad(spot.at(x - 1.6, -out, z), spot.at(x - 1.6, 0, z), spot.at(x + 1.6, 0, z),
                    spot.at(x + 1.6, -out, z), slab);
    }
  }
  if (size.has_shop && random->chance(0.45)) {  // awning
    Paint cloth;
    cloth.material = kFirstSign + random->index(kSigns);
    cloth.brightness = random->uniform(0.4, 1.1);
    cloth.two_sided = true;
    builder->quad(spot.at(0.1 * w, -1.4, 2.3), spot.at(0.9 * w, -1.4, 2.3), spot.at(0.9 * w, 0, 2.9),
                  spot.at(0.1 * w, 0, 2.9), cloth);
  }
  builder->end_cluster();
}

void add_car(MeshBuilder* builder, const Spot& spot, double paint) {
  constexpr double kLength = 4.4, kHalfWidth = 0.89, kBody = 0.86, kRoof = 1.46, kGround = 0.16;
  Paint side, front, roof;
  side.material = kCarSide;
  front.material = kCarFront;
  roof.material = kCarRoof;
  side.brightness = front.brightness = roof.brightness = paint;
  builder->begin_cluster();
  const double x0 = -0.5 * kLength, x1 = 0.5 * kLength;
  const double cab0 = x0 + 0.35, cab1 = x1 - 1.35, top0 = x0 + 0.95, top1 = x1 - 2.1;  // cabin, roof
  for (const double y : {-kHalfWidth, kHalfWidth}) {
    const double a = y < 0 ? x0 : x1, b = y < 0 ? x1 : x0;  // counter-clockwise from outside
    builder->quad(spot.at(a, y, kGround), spot.at(b, y, kGround), spot.at(b, y, kBody), spot.at(a, y, kBody),
                  side, 0, kGround);
    const double c = y < 0 ? cab0 : cab1, d = y < 0 ? cab1 : cab0, e = y < 0 ? top1 : top0,
                 f = y < 0 ? top0 : top1;
    builder->quad(spot.at(c, y, kBody), spot.at(d, y, kBody), spot.at(e, 0.9 * y, kRoof),
                  spot.at(f, 0.9 * y, kRoof), side, std::abs(c - a), kBody);
  }
  const auto across = [&](double xl, double zl, double xh, double zh, const Paint& p, double t) {  // faces +x
    builder->quad(spot.at(xl, -kHalfWidth, zl), spot.at(xl, kHalfWidth, zl), spot.at(xh, kHalfWidth, zh),
                  spot.at(xh, -kHalfWidth, zh), p, 0.0, t);
  };
  const auto back = [&](double xl, double zl, double xh, double zh, const Paint& p, double t) {  // faces -x
    builder->quad(spot.at(xl, kHalfWidth, zl), spot.at(xl, -kHalfWidth, zl), spot.at(xh, -kHalfWidth, zh),
                  spot.at(xh, kHalfWidth, zh), p, 0.0, t);
  };
  across(x1, kGround, x1, kBody, front, kGround);
  across(x1, kBody, cab1, kBody + 0.02, roof, 0.0);
  across(cab1, kBody + 0.02, top1, kRoof, front, kBody);
  across(top1, kRoof, top0, kRoof, roof, 0.0);
  back(x0, kGround, x0, kBody, front, kGround);
  back(x0, kBody, cab0, kBody + 0.02, roof, 0.0);
  back(cab0, kBody + 0.02, top0, kRoof, front, kBody);
  builder->end_cluster();
}

void add_lamp(MeshBuilder* builder, const Spot& spot, double height_m, double arm_m) {
  builder->begin_cluster();
  add_post(builder, spot.base, height_m, 0.16, kMetal, 0.5);
  Paint head;
  head.material = kMetal;
  head.brightness = 1.3;
  builder->box(spot.at(0.5 * arm_m, 0, height_m - 0.1), 0.5 * arm_m, 0.05, 0.1, spot.yaw_rad, head, head);
  builder->box(spot.at(arm_m, 0, height_m - 0.22), 0.35, 0.14, 0.16, spot.yaw_rad, head, head);
  builder->end_cluster();
}

void add_sign(MeshBuilder* builder, const Spot& spot, double size_m, double height_m, Random* random) {
  builder->begin_cluster();
  add_post(builder, spot.base, height_m + size_m, 0.08, kMetal, 0.8);
  Paint board, rear;
  board.material = kFirstSign + random->index(kSigns);
  rear.material = kMetal;
  const double s = random->uniform(0.0, 2.0 - size_m), t = random->uniform(0.0, 2.0 - size_m),
               h = 0.5 * size_m;
  builder->quad(spot.at(-0.06, h, height_m), spot.at(-0.06, -h, height_m),
                spot.at(-0.06, -h, height_m + size_m), spot.at(-0.06, h, height_m + size_m), board, s, t);
  builder->quad(spot.at(-0.05, -h, height_m), spot.at(-0.05, h, height_m),
                spot.at(-0.05, h, height_m + size_m), spot.at(-0.05, -h, height_m + size_m), rear);
  builder->end_cluster();
}

void add_gantry(MeshBuilder* builder, const Spot& spot, double half_span_m, Random* random) {
  builder->begin_cluster();
  Paint beam;
  beam.material = kMetal;
  beam.brightness = 0.8;
  for (const double y : {-half_span_m, half_span_m}) {
    builder->box(spot.at(0, y, -1), 0.25, 0.25, 8.0, spot.yaw_rad, beam, beam);
  }
  builder->box(spot.at(0, 0, 6.4), 0.3, half_span_m, 0.7, spot.yaw_rad, beam, beam);
  for (double y = -half_span_m + 1.5; y < half_span_m - 4.0; y += random->uniform(5.5, 9.0)) {
    Paint board;
    board.material = kFirstSign + random->index(kSigns);
    const double w = random->uniform(3.0, 4.5), h = random->uniform(2.0, 3.2);
    builder->quad(spot.at(-0.4, y + w, 5.4), spot.at(-0.4, y, 5.4), spot.at(-0.4, y, 5.4 + h),
                  spot.at(-0.4, y + w, 5.4 + h), board, random->uniform(0, 2), random->uniform(0, 2));
    builder->quad(spot.at(-0.39, y, 5.4), spot.at(-0.39, y + w, 5.4), spot.at(-0.39, y + w, 5.4 + h),
                  spot.at(-0.39, y, 5.4 + h), beam);
  }
  builder->end_cluster();
}

void add_box(MeshBuilder* builder, const Spot& spot, const Eigen::Vector3d& size_m, int material,
             double paint) {
  builder->begin_cluster();
  Paint sides;
  sides.material = material;
  sides.brightness = paint;
  builder->box(spot.base, 0.5 * size_m.x(), 0.5 * size_m.y(), size_m.z(), spot.yaw_rad, sides, sides);
  builder->end_cluster();
}

void add_tower(MeshBuilder* builder, const Spot& spot, double height_m, Random* random) {
  builder->begin_cluster();
  Paint wall;
  wall.brightness = random->uniform(0.6, 1.3);
  const int kind = random->index(4);
  if (kind == 0) {  // slender, like a television tower
    wall.material = kConcrete;
    double z = -10.0, half = 0.035 * height_m;
    for (int i = 0; i < 6; ++i, half *= 0.72) {
      const double rise = height_m * (i == 0 ? 0.35 : 0.15);
      builder->box(spot.at(0, 0, z), half, half, rise, spot.yaw_rad + 0.3 * i, wall, wall);
      z += rise;
      if (i == 3)
        builder->box(spot.at(0, 0, z), 3.2 * half, 3.2 * half, 0.06 * height_m, spot.yaw_rad, wall, wall);
    }
  } else {
    wall.material = kind == 1 ? kGlassTower : kFirstFacade + random->index(kFacades);
    const double half_x = random->uniform(9.0, 20.0), half_y = random->uniform(9.0, 16.0);
    builder->box(spot.at(0, 0, -15), half_x, half_y, 0.8 * height_m + 15, spot.yaw_rad, wall, wall);
    builder->box(spot.at(random->uniform(-3, 3), 0, 0.8 * height_m), 0.7 * half_x, 0.7 * half_y,
                 0.2 * height_m, spot.yaw_rad, wall, wall);
    Paint mast;
    mast.material = kMetal;
    builder->box(spot.at(0, 0, height_m), 0.6, 0.6, 0.15 * height_m, spot.yaw_rad, mast, mast);
  }
  builder->end_cluster();
}

}  // namespace farpoint::tools::simulate
