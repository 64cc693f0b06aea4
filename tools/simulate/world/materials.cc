// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/world/materials.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/simulate/world/canvas.h"
#include "tools/simulate/world/noise.h"
#include "tools/simulate/world/random.h"

namespace farpoint::tools::simulate {
namespace {

constexpr double kPi = std::numbers::pi;

float clamped(double value) {
  return static_cast<float>(std::clamp(value, 0.01, 1.0));
}

void lay_bricks(Canvas* canvas, std::uint64_t seed, double brick_m, double course_m, double joint_m,
                float brick, float joint) {
  const int courses = static_cast<int>(std::lround(canvas->height_m() / course_m));
  const int columns = static_cast<int>(std::lround(canvas->width_m() / brick_m));
  canvas->each([=](double x, double y, float) {
    const double row = y / canvas->height_m() * courses;
    const int r = static_cast<int>(row);
    const double column = x / canvas->width_m() * columns + 0.5 * (r & 1);
    const int c = static_cast<int>(column) % columns;
    const bool in_joint = (row - r) * course_m < joint_m || (column - std::floor(column)) * brick_m < joint_m;
    const double tone = static_cast<double>(seed_at(seed, c, r) >> 40) / 16777216.0;
    return in_joint ? joint : clamped(brick * (0.7 + 0.6 * tone));
  });
}

struct WindowStyle {
  double width_m, height_m, sill_m;  // sill: height above the floor
  int panes;
  double frame_m;
  bool surround;  // lintel, sill and jambs of another stone
  bool shutters;
};

void draw_window(Canvas* canvas, Random* random, double x, double floor_m, const WindowStyle& style,
                 float frame) {
  const double x0 = x - 0.5 * style.width_m, x1 = x + 0.5 * style.width_m;
  const double y0 = floor_m + style.sill_m, y1 = y0 + style.height_m;
  if (style.surround) canvas->rectangle(x0 - 0.14, y0 - 0.1, x1 + 0.14, y1 + 0.2, clamped(frame * 0.9));
  canvas->rectangle(x0 - 0.2, y0 - 0.16, x1 + 0.2, y0 - 0.06, clamped(frame * 0.95));
  canvas->rectangle(x0 - 0.2, y0 - 0.22, x1 + 0.2, y0 - 0.16, 0.06F);  // the sill's shadow
  canvas->rectangle(x0, y0, x1, y1, frame);
  if (style.shutters) {
    const float tone = clamped(0.12 + 0.3 * random->uniform());
    for (const double at : {x0 - 0.48 * style.width_m, x1 + 0.04}) {
      canvas->rectangle(at, y0, at + 0.44 * style.width_m, y1, tone);
      for (double y = y0 + 0.1; y < y1 - 0.05; y += 0.16)
        canvas->rectangle(at + 0.05, y, at + 0.44 * style.width_m - 0.05, y + 0.05, clamped(tone * 0.6));
    }
  }
  const double pane = (style.width_m - style.frame_m) / style.panes;
  for (int i = 0; i < style.panes; ++i) {
    const double left = x0 + style.frame_m + i * pane;
    const float glass = clamped(0.03 + 0.1 * random->uniform());
    canvas->rectangle(left, y0 + style.frame_m, left + pane - style.frame_m, y1 - style.frame_m, glass);
    const double kind = random->uniform();
    if (kind < 0.35) {  // curtain
      const double drop = random->uniform(0.3, 1.0) * (style.height_m - 2 * style.frame_m);
      canvas->rectangle(left, y1 - style.frame_m - drop, left + pane - style.frame_m, y1 - style.frame_m,
                        clamped(0.25 + 0.3 * random->uniform()));
    } else if (kind < 0.6) {  // the sky's reflection
      canvas->rectangle(left, y0 + style.frame_m + 0.55 * style.height_m, left + pane - style.frame_m,
                        y1 - style.frame_m, clamped(0.2 + 0.25 * random->uniform()));
    }
  }
  canvas->rectangle(x0, y0 + 0.68 * style.height_m, x1, y0 + 0.68 * style.height_m + style.frame_m, frame);
  canvas->rectangle(x0, y1, x1, y1 + 0.05, 0.05F);  // shadow of the lintel
}

}  // namespace

MaterialLibrary::MaterialLibrary(std::uint64_t seed)
    : seed_(seed_of(seed, "materials")),
      materials_(kMaterialCount),
      soft_(seed_of(seed_, "soft"), 4, 4, 0.6),
      rough_(seed_of(seed_, "rough"), 6, 6, 0.8) {
  const std::uint64_t grain_seed = seed_of(seed_, "grain");
  grain_ = add(Texture(256, 256, [=](double u, double v) {
    return 0.5 + 0.42 * periodic_fractal(grain_seed, 5 * u, 5 * v, 5, 6, 0.85);
  }));
  add_ground();
  add_roads();
  add_facades();
  add_walls();
  add_plants();
  add_objects();
}

MaterialLibrary::~MaterialLibrary() = default;

// Multiplies a canvas by tileable dirt: streaks and blotches of a few decimetres to metres.
void MaterialLibrary::weather(Canvas* canvas, std::uint64_t seed, double strength) const {
  Random random(seed);
  const double du = random.uniform(), dv = random.uniform();
  canvas->each([&](double x, double y, float value) {
    const double u = x / canvas->width_m() + du, v = y / canvas->height_m() + dv;
    // Rain runs straight down.
    return clamped(value * (1.0 + strength * (soft_.at(u, v) + 0.35 * rough_.at(2.0 * u, dv))));
  });
}

const Texture* MaterialLibrary::add(Texture texture) {
  textures_.push_back(std::make_unique<Texture>(std::move(texture)));
  return textures_.back().get();
}

Layer MaterialLibrary::detail(double period_m) const {
  return {grain_, period_m, period_m, 1.0 / grain_->mean()};
}

void MaterialLibrary::add_ground() {
  const std::uint64_t seed = seed_of(seed_, "ground");
  const auto modulating = [](const Texture* texture, double period_m) {
    return Layer{texture, period_m, period_m, 1.0 / texture->mean()};
  };
  // Kilometres: what one sees on far slopes.
  const Texture* wild = add(Texture(1024, 1024, [=, this](double u, double v) {
    const double patches = 0.8 * soft_.at(2 * u, 2 * v) + 0.35 * rough_.at(8 * u, 8 * v);
    const double groves = soft_.at(6 * u + 0.3, 6 * v);
    return 0.30 + 0.22 * patches - (groves > 0.12 ? 0.13 : 0.0);
  }));
  const Texture* fields = add(Texture(1024, 1024, [=, this](double u, double v) {
    // Plots: the strips of bent cells, each with a tone and furrows' direction of its own; dark hedges
    // between.
    const double bend = 0.4 * periodic_noise(seed + 31, 5 * u, 5 * v, 5);
    const Cells plot = periodic_cells(seed + 30, 14 * u + bend, 14 * v - bend, 14);
    const double tone = static_cast<double>(plot.id >> 40) / 16777216.0;
    const bool hedge = plot.second - plot.nearest < 0.05;
    const double mottle = rough_.at(7 * u, 7 * v);
    return (hedge ? 0.08 : 0.16 + 0.34 * tone) * (1.0 + 0.25 * mottle);
  }));
  const Texture* canopy = add(Texture(512, 512, [=](double u, double v) {
    const Cells crown = periodic_cells(seed + 40, 14 * u, 14 * v, 14);
    const double tone = static_cast<double>(crown.id >> 40) / 16777216.0;
    const double round = std::max(0.0, 1.0 - 1.3 * crown.nearest);
    return (0.12 + 0.5 * round * (0.6 + 0.8 * tone)) *
           (1.0 + 0.4 * periodic_fractal(seed + 41, 32 * u, 32 * v, 32, 4, 0.8));
  }));
  const Texture* meadow = add(Texture(512, 512, [=](double u, double v) {
    const double tufts = periodic_fractal(seed + 50, 16 * u, 16 * v, 16, 6, 0.8);
    const Cells herbs = periodic_cells(seed + 51, 40 * u, 40 * v, 40);
    return 0.45 + 0.6 * tufts + (herbs.nearest < 0.17 && (herbs.id & 7) == 0 ? 0.35 : 0.0);
  }));
  const Texture* blades = add(Texture(256, 256, [=](double u, double v) {
    const double lean = 0.1 * periodic_noise(seed + 61, 6 * u, 6 * v, 6);
    return 0.5 + 0.45 * periodic_fractal(seed + 60, 40 * (u + lean), 20 * v, 20, 3, 0.8) +
           0.2 * periodic_fractal(seed + 62, 24 * u, 24 * v, 24, 4, 0.8);
  }));
  const Texture* pebbles = add(Texture(512, 512, [=](double u, double v) {
    const Cells big = periodic_cells(seed + 70, 22 * u, 22 * v, 22),
                small = periodic_cells(seed + 71, 60 * u, 60 * v, 60);
    const double tone_big = static_cast<double>(big.id >> 40) / 16777216.0;
    const double tone = static_cast<double>(small.id >> 40) / 16777216.0;
    const double edge = std::min(1.0, 5.0 * (small.second - small.nearest));
    const double value = (0.25 + 0.45 * tone) * (0.4 + 0.6 * edge);
    return big.nearest < 0.3 && tone_big > 0.6 ? 0.3 + 0.5 * tone_big - 0.5 * big.nearest : value;
  }));
  const Texture* crags = add(Texture(512, 512, [=](double u, double v) {
    const double cracks = std::abs(periodic_fractal(seed + 80, 6 * u, 9 * v, 3, 6, 0.7));
    const double strata = periodic_noise(seed + 82, 4 * u, 40 * v, 4);
    return 0.2 + 0.9 * cracks + 0.12 * strata + 0.2 * periodic_fractal(seed + 81, 30 * u, 30 * v, 30, 4, 0.8);
  }));
  const double albedo = 1.0 / 255.0;
  materials_[kGround].layers = {{wild, kGroundPeriod_m, kGroundPeriod_m, 0.95 * albedo},
                                modulating(meadow, 16.0),
                                modulating(blades, 1.0)};
  materials_[kFields].layers = {
      {fields, kGroundPeriod_m, kGroundPeriod_m, albedo}, modulating(meadow, 32.0), modulating(blades, 2.0)};
  materials_[kForest].layers = {{wild, kGroundPeriod_m, kGroundPeriod_m, 0.45 * albedo},
                                modulating(canopy, 128.0),
                                modulating(grain_, 8.0)};
  materials_[kRock].layers = {{wild, kGroundPeriod_m, kGroundPeriod_m, 1.1 * albedo},
                              modulating(crags, 256.0),
                              modulating(crags, 16.0)};
  materials_[kGravel].layers = {modulating(meadow, 64.0), {pebbles, 2.0, 2.0, 0.8 * albedo}};
  materials_[kGravel].layers[0].gain *= 1.0;
  materials_[kStone].layers = {{crags, 6.0, 6.0, 0.9 * albedo}, detail(0.7)};
}

void MaterialLibrary::add_roads() {
  const std::uint64_t seed = seed_of(seed_, "roads");
  const double albedo = 1.0 / 255.0;
  // Asphalt under whatever is painted on it: wheel tracks, patches, cracks, repaired seams.
  const auto asphalt = [this, seed](double x, double y, double width_m, double length_m, int lanes) {
    const double u = x / width_m, v = y / length_m;
    const double lane = std::fmod(u * lanes, 1.0);
    const double tracks =
        std::exp(-40 * (lane - 0.25) * (lane - 0.25)) + std::exp(-40 * (lane - 0.75) * (lane - 0.75));
    const double blotch = rough_.at(u, 3 * v);
    const double crack = std::abs(soft_.at(u, 2 * v));
    const double patch = periodic_noise(seed + 5, 4 * u, 8 * v, 4) > 0.42 ? -0.05 : 0.0;
    return 0.25 + 0.02 * tracks + 0.14 * blotch + patch - (crack < 0.012 ? 0.12 : 0.0);
  };
  const auto road = [&](double width_m, int lanes, const std::function<void(Canvas*)>& paint) {
    constexpr double kLength_m = 24.0;
    Canvas canvas(512, 1024, width_m, kLength_m, 0.0F);
    canvas.each([&](double x, double y, float) { return clamped(asphalt(x, y, width_m, kLength_m, lanes)); });
    // Manhole covers and drains.
    Random random(seed_of(seed, "covers") + static_cast<std::uint64_t>(lanes));
    for (int i = 0; i < 2; ++i) {
      const double x = random.uniform(0.2, 0.8) * width_m, y = random.uniform(0.1, 0.9) * kLength_m;
      canvas.ellipse(x, y, 0.38, 0.38, 0, 0.09F);
      canvas.ellipse(x, y, 0.31, 0.31, 0, 0.3F);
      for (int k = -2; k <= 2; ++k)
        canvas.rectangle(x - 0.2, y + 0.1 * k - 0.02, x + 0.2, y + 0.1 * k + 0.02, 0.12F);
    }
    paint(&canvas);
    // Worn paint shows the asphalt's grain.
    canvas.each([&](double x, double y, float value) {
      const double wear = rough_.at(3 * x / width_m, 6 * y / kLength_m);
      return clamped(value * (1.0 + (value > 0.5F ? 0.5 : 0.2) * wear));
    });
    return add(canvas.texture());
  };
  const auto dashes = [](Canvas* canvas, double x, double dash_m, double gap_m, double width_m) {
    for (double y = 0; y < canvas->height_m() - 0.1; y += dash_m + gap_m)
      canvas->rectangle(x - 0.5 * width_m, y, x + 0.5 * width_m, y + dash_m, 0.75F);
  };
  const Texture* two_lanes = road(8.0, 2, [&](Canvas* canvas) {
    dashes(canvas, 4.0, 3.0, 5.0, 0.14);
    canvas->rectangle(0.25, 0, 0.37, 24, 0.7F);
    canvas->rectangle(7.63, 0, 7.75, 24, 0.7F);
  });
  const Texture* motorway = road(11.0, 3, [&](Canvas* canvas) {
    dashes(canvas, 4.0, 6.0, 6.0, 0.16);
    canvas->rectangle(0.35, 0, 0.55, 24, 0.75F);
    canvas->rectangle(7.6, 0, 7.85, 24, 0.75F);
  });
  const Texture* plain = road(16.0, 5, [](Canvas*) {});
  materials_[kRoadTwoLanes].layers = {{two_lanes, 8.0, 24.0, albedo}, detail(0.9)};
  materials_[kRoadMotorway].layers = {{motorway, 11.0, 24.0, albedo}, detail(0.9)};
  materials_[kAsphalt].layers = {{plain, 16.0, 24.0, albedo}, detail(0.9)};

  const Texture* track = add(Texture(512, 1024, [=](double u, double v) {
    const double x = 4.0 * u, wander = 0.15 * periodic_noise(seed + 20, v * 3, 0.5, 3);
    const double rut =
        std::exp(-9 * std::pow(x - 1.2 - wander, 2)) + std::exp(-9 * std::pow(x - 2.8 - wander, 2));
    const Cells stone = periodic_cells(seed + 21, 48 * u, 144 * v, 48);
    const double tone = static_cast<double>(stone.id >> 40) / 16777216.0;
    const double grass = x > 1.7 && x < 2.3 ? -0.14 : 0.0;
    return 0.34 + 0.14 * rut + grass +
           0.16 * (tone - 0.5) * std::min(1.0, 4 * (stone.second - stone.nearest)) +
           0.16 * periodic_fractal(seed + 22, 4 * u, 12 * v, 4, 5, 0.7);
  }));
  materials_[kTrack].layers = {{track, 4.0, 12.0, albedo}, detail(0.6)};

  Canvas slabs(512, 512, 4.8, 4.8, 0.0F);
  lay_bricks(&slabs, seed + 30, 0.6, 0.4, 0.014, 0.42F, 0.16F);
  weather(&slabs, seed + 31, 0.25);
  materials_[kPavement].layers = {{add(slabs.texture()), 4.8, 4.8, albedo}, detail(0.7)};
  Canvas kerb(256, 32, 4.0, 0.5, 0.5F);
  for (int i = 0; i < 4; ++i) kerb.rectangle(i, 0, i + 0.02, 0.5, 0.1F);
  weather(&kerb, seed + 32, 0.35);
  materials_[kKerb].layers = {{add(kerb.texture()), 4.0, 0.5, albedo}};
}

void MaterialLibrary::add_facades() {
  const double albedo = 1.0 / 255.0;
  for (int i = 0; i < kFacades; ++i) {
    const std::uint64_t seed = seed_of(seed_, "facade") + static_cast<std::uint64_t>(i);
    Random random(seed);
    Canvas wall(512, 512, 12.0, 9.6, 0.0F);
    const float tone = clamped(random.uniform(0.22, 0.72));
    if (i % 3 == 0) {
      lay_bricks(&wall, seed, 0.25, 0.1, 0.022, clamped(0.18 + 0.15 * random.uniform()), 0.42F);
    } else {
      wall.rectangle(0, 0, 12, 9.6, tone);
    }
    weather(&wall, seed + 1, 0.16);
    if (i % 3 == 1) wall.rectangle(0, 0, 12, 0.28, clamped(tone * 1.35));  // a string course a storey group
    WindowStyle style{random.uniform(0.9, 1.5),
                      random.uniform(1.3, 1.8),
                      random.uniform(0.75, 0.95),
                      1 + random.index(3),
                      0.07,
                      i % 2 == 0,
                      i % 4 == 1};
    if (i % 5 == 3) style = {2.2, 1.5, 0.9, 3, 0.08, false, false};  // offices: bands of windows
    const int columns = i % 5 == 3 ? 4 : 3 + random.index(3);
    const float frame = i % 4 == 2 ? 0.12F : 0.8F;
    for (int floor = 0; floor < 3; ++floor) {
      for (int c = 0; c < columns; ++c) {
        if (random.chance(0.06)) continue;  // walled up
        draw_window(&wall, &random, (c + 0.5) * 12.0 / columns, floor * 3.2, style, frame);
      }
    }
    if (random.chance(0.6)) {  // downpipe
      const double x = random.uniform(0.05, 0.2);
      wall.rectangle(x, 0, x + 0.12, 9.6, 0.16F);
      for (int k = 0; k < 4; ++k) wall.rectangle(x - 0.04, 2.4 * k, x + 0.16, 2.4 * k + 0.07, 0.4F);
    }
    nth(kFirstFacade, i).layers = {{add(wall.texture()), 12.0, 9.6, albedo}, detail(1.1)};
  }
  for (int i = 0; i < kShops; ++i) {
    const std::uint64_t seed = seed_of(seed_, "shop") + static_cast<std::uint64_t>(i);
    Random random(seed);
    Canvas wall(512, 256, 12.0, 3.6, clamped(random.uniform(0.2, 0.55)));
    wall.rectangle(0, 0, 12, 0.5, clamped(random.uniform(0.12, 0.3)));  // base
    for (double x = 0.4; x < 11.0;) {
      const double width = random.uniform(1.0, 3.0);
      if (x + width > 11.7) break;
      if (width < 1.5) {  // door
        wall.rectangle(x - 0.1, 0, x + width + 0.1, 2.6, 0.6F);
        wall.rectangle(x, 0, x + width, 2.45, clamped(random.uniform(0.05, 0.3)));
        for (int k = 0; k < 3; ++k)
          wall.rectangle(x + 0.12, 0.2 + 0.75 * k, x + width - 0.12, 0.75 + 0.75 * k,
                         clamped(random.uniform(0.04, 0.35)));
      } else {  // shop window with goods
        wall.rectangle(x - 0.08, 0.45, x + width + 0.08, 2.7, clamped(random.uniform(0.1, 0.8)));
        wall.rectangle(x, 0.55, x + width, 2.6, 0.06F);
        for (int k = 0; k < 9; ++k) {
          const double gx = x + random.uniform(0.05, 0.85) * width, gy = random.uniform(0.6, 2.2);
          wall.rectangle(gx, gy, std::min(gx + random.uniform(0.1, 0.5), x + width),
                         std::min(gy + random.uniform(0.1, 0.5), 2.6), clamped(random.uniform(0.1, 0.9)));
        }
      }
      x += width + random.uniform(0.25, 0.9);
    }
    const float board = clamped(random.uniform(0.1, 0.8));  // name board with letters
    wall.rectangle(0.3, 2.8, 11.7, 3.4, board);
    for (double x = random.uniform(0.6, 3.0); x < 8.5; x += random.uniform(0.28, 0.5)) {
      if (random.chance(0.15)) continue;
      const float ink = board > 0.45F ? 0.06F : 0.85F;
      wall.rectangle(x, 2.92, x + 0.07, 3.28, ink);
      const double y = 2.92 + 0.15 * random.index(3);
      wall.rectangle(x, y, x + 0.22, y + 0.07, ink);
      if (random.chance(0.5)) wall.rectangle(x + 0.15, 2.92, x + 0.22, 3.28, ink);
    }
    weather(&wall, seed + 1, 0.12);
    nth(kFirstShop, i).layers = {{add(wall.texture()), 12.0, 3.6, albedo}, detail(1.1)};
  }
}

void MaterialLibrary::add_walls() {
  const std::uint64_t seed = seed_of(seed_, "walls");
  const double albedo = 1.0 / 255.0;
  Canvas brick(512, 512, 4.0, 4.0, 0.0F);
  lay_bricks(&brick, seed, 0.25, 0.08, 0.013, 0.26F, 0.45F);
  weather(&brick, seed + 1, 0.4);
  materials_[kBrickWall].layers = {{add(brick.texture()), 4.0, 4.0, albedo}, detail(0.8)};
  Canvas concrete(512, 512, 8.0, 8.0, 0.45F);
  weather(&concrete, seed + 2, 0.4);
  for (int i = 0; i < 4; ++i) {  // formwork joints and anchor holes
    concrete.rectangle(0, 2 * i, 8, 2 * i + 0.03, 0.2F);
    concrete.rectangle(2 * i, 0, 2 * i + 0.03, 8, 0.2F);
    for (int k = 0; k < 8; ++k) concrete.ellipse(k + 0.5, 2 * i + 0.6, 0.05, 0.05, 0, 0.12F);
  }
  materials_[kConcrete].layers = {{add(concrete.texture()), 8.0, 8.0, albedo}, detail(1.0)};
  Canvas tiles(256, 256, 3.2, 3.2, 0.0F);
  lay_bricks(&tiles, seed + 3, 0.2, 0.32, 0.03, 0.2F, 0.07F);
  weather(&tiles, seed + 4, 0.4);
  materials_[kRoofTiles].layers = {{add(tiles.texture()), 3.2, 3.2, albedo}, detail(5.0)};
  Canvas flat(256, 256, 16.0, 16.0, 0.28F);
  weather(&flat, seed + 5, 0.6);
  for (int i = 0; i < 4; ++i) flat.rectangle(0, 4 * i, 16, 4 * i + 0.12, 0.14F);
  Random random(seed + 6);
  for (int i = 0; i < 7; ++i) {  // skylights, vents
    const double x = random.uniform(1, 14), y = random.uniform(1, 14), w = random.uniform(0.5, 1.6);
    flat.rectangle(x - 0.15, y - 0.15, x + w + 0.15, y + w + 0.15, 0.6F);
    flat.rectangle(x, y, x + w, y + w, 0.08F);
  }
  materials_[kRoofFlat].layers = {{add(flat.texture()), 16.0, 16.0, albedo}, detail(1.5)};
  Canvas glass(256, 256, 12.0, 14.0, 0.1F);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 8; ++x)
      glass.rectangle(1.5 * x + 0.1, 3.5 * y + 0.9, 1.5 * x + 1.42, 3.5 * y + 3.4,
                      clamped(random.uniform(0.1, 0.5)));
    glass.rectangle(0, 3.5 * y, 12, 3.5 * y + 0.7, 0.6F);
  }
  materials_[kGlassTower].layers = {{add(glass.texture()), 12.0, 14.0, albedo}};
  Canvas fence(128, 128, 2.0, 2.0, 0.0F);
  for (int i = 0; i < 8; ++i) fence.rectangle(0.25 * i + 0.05, 0, 0.25 * i + 0.11, 2, 0.9F);
  for (const double y : {0.2, 1.5}) fence.rectangle(0, y, 2, y + 0.1, 0.9F);
  materials_[kFence].layers = {{add(fence.texture()), 2.0, 2.0, 0.3 * albedo}};
  materials_[kFence].cutout = materials_[kFence].layers[0].texture;
}

void MaterialLibrary::add_plants() {
  const double albedo = 1.0 / 255.0;
  for (int i = 0; i < kFoliages; ++i) {
    const std::uint64_t seed = seed_of(seed_, "foliage") + static_cast<std::uint64_t>(i);
    Random random(seed);
    // Leaves as blobs in clumps, dark inside and bright at the top; what is below one half is a hole.
    Canvas leaves(256, 256, 4.0, 4.0, 0.0F);
    for (int clump = 0; clump < 30; ++clump) {
      const double angle = random.uniform(0, 2 * kPi), reach = 1.75 * std::sqrt(random.uniform());
      const double cx = 2 + reach * std::cos(angle), cy = 2 + reach * std::sin(angle);
      const double spread = random.uniform(0.22, 0.5) * (1.0 - 0.3 * reach / 1.75);
      for (int leaf = 0; leaf < 26; ++leaf) {
        const double x = std::clamp(cx + spread * random.normal() * 0.7, 0.15, 3.85);
        const double y = std::clamp(cy + spread * random.normal() * 0.7, 0.15, 3.85);
        const double light = 0.62 + 0.2 * random.uniform() + 0.18 * std::clamp((y - cy) / spread, -0.6, 1.0);
        leaves.ellipse(x, y, random.uniform(0.05, 0.12), random.uniform(0.03, 0.07), random.uniform(0, kPi),
                       clamped(std::max(0.53, light)));
      }
    }
    Texture shape = leaves.texture();
    shape.keep_coverage();
    const Texture* cutout = add(std::move(shape));
    // Shaded with a tone of its own: holes filled, so that coarse levels do not darken towards the outline.
    const std::uint64_t tone_seed = seed + 77;
    Canvas tone = leaves;
    tone.each([=](double x, double y, float value) {
      const double base = value > 0.0F ? (value - 0.5) * 0.95 : 0.1;
      return clamped(0.02 + base * (1.0 + 0.5 * periodic_fractal(tone_seed, 1.5 * x, 1.5 * y, 6, 4, 0.7)));
    });
    Material& material = nth(kFirstFoliage, i);
    material.layers = {{add(tone.texture()), 4.0, 4.0, albedo}};
    material.cutout = cutout;
  }
  const std::uint64_t seed = seed_of(seed_, "plants");
  materials_[kBark].layers = {{add(Texture(128, 256,
                                           [=](double u, double v) {
                                             return 0.2 +
                                                    0.22 * periodic_fractal(seed, 12 * u, 6 * v, 6, 5, 0.8);
                                           })),
                               1.0, 2.0, albedo}};
  materials_[kHedge].layers = {
      {add(Texture(256, 256,
                   [=](double u, double v) {
                     const Cells leaf = periodic_cells(seed + 5, 36 * u, 36 * v, 36);
                     const double tone = static_cast<double>(leaf.id >> 40) / 16777216.0;
                     return 0.06 + 0.3 * tone * std::min(1.0, 3 * (leaf.second - leaf.nearest)) +
                            0.1 * periodic_fractal(seed + 6, 6 * u, 6 * v, 6, 4, 0.7);
                   })),
       2.0, 2.0, albedo}};
}

void MaterialLibrary::add_objects() {
  const std::uint64_t seed = seed_of(seed_, "objects");
  const double albedo = 1.0 / 255.0;
  Random random(seed);
  materials_[kMetal].layers = {{add(Texture(64, 64,
                                            [=](double u, double v) {
                                              return 0.45 +
                                                     0.15 * periodic_fractal(seed, 4 * u, 4 * v, 4, 4, 0.7);
                                            })),
                                1.0, 1.0, albedo}};
  for (int i = 0; i < kSigns; ++i) {
    Canvas sign(128, 128, 2.0, 2.0, 0.85F);
    const float field = clamped(i % 2 == 0 ? random.uniform(0.08, 0.25) : random.uniform(0.6, 0.8));
    sign.rectangle(0.08, 0.08, 1.92, 1.92, field);
    const float ink = field > 0.4F ? 0.05F : 0.9F;
    for (int line = 0; line < 4; ++line) {
      for (double x = 0.2; x < random.uniform(1.0, 1.8); x += 0.14) {
        sign.rectangle(x, 0.25 + 0.42 * line, x + 0.04, 0.5 + 0.42 * line, ink);
        sign.rectangle(x, 0.25 + 0.42 * line + 0.1 * random.index(3), x + 0.1,
                       0.31 + 0.42 * line + 0.1 * random.index(2), ink);
      }
    }
    nth(kFirstSign, i).layers = {{add(sign.texture()), 2.0, 2.0, albedo}};
  }
  Canvas side(512, 128, 4.4, 1.5, 0.6F);
  side.rectangle(0, 0, 4.4, 0.18, 0.05F);
  side.rectangle(0, 0.62, 4.4, 0.66, 0.35F);
  side.rectangle(0.7, 0.9, 1.9, 1.38, 0.07F);
  side.rectangle(2.0, 0.9, 3.3, 1.38, 0.07F);
  side.rectangle(1.94, 0.2, 1.97, 1.4, 0.2F);
  side.rectangle(1.7, 0.75, 1.9, 0.79, 0.15F);
  for (const double x : {0.85, 3.55}) {
    side.ellipse(x, 0.3, 0.36, 0.36, 0, 0.04F);
    side.ellipse(x, 0.3, 0.22, 0.22, 0, 0.55F);
    side.ellipse(x, 0.3, 0.08, 0.08, 0, 0.1F);
  }
  materials_[kCarSide].layers = {{add(side.texture()), 4.4, 1.5, albedo}};
  Canvas front(128, 128, 1.8, 1.5, 0.55F);
  front.rectangle(0, 0, 1.8, 0.22, 0.05F);
  front.rectangle(0.2, 0.88, 1.6, 1.36, 0.08F);
  front.rectangle(0.1, 0.55, 0.4, 0.72, 0.95F);
  front.rectangle(1.4, 0.55, 1.7, 0.72, 0.95F);
  front.rectangle(0.64, 0.36, 1.16, 0.48, 0.9F);
  front.rectangle(0.5, 0.52, 1.3, 0.68, 0.12F);
  materials_[kCarFront].layers = {{add(front.texture()), 1.8, 1.5, albedo}};
  materials_[kCarRoof].layers = {{add(Texture(64, 64,
                                              [=](double u, double v) {
                                                return 0.55 +
                                                       0.06 * periodic_fractal(seed + 3, 2 * u, 2 * v, 2, 3);
                                              })),
                                  2.0, 2.0, albedo}};
  Canvas container(256, 128, 6.0, 2.6, 0.3F);
  for (int i = 0; i < 24; ++i) {
    container.rectangle(0.25 * i, 0.15, 0.25 * i + 0.09, 2.45, 0.2F);
    container.rectangle(0.25 * i + 0.09, 0.15, 0.25 * i + 0.12, 2.45, 0.42F);
  }
  container.rectangle(1.0, 1.6, 2.6, 2.1, 0.75F);
  for (int i = 0; i < 9; ++i) container.rectangle(3.6 + 0.24 * i, 1.9, 3.74 + 0.24 * i, 2.2, 0.8F);
  weather(&container, seed + 4, 0.35);
  materials_[kContainer].layers = {{add(container.texture()), 6.0, 2.6, albedo}, detail(0.8)};
}

std::unique_ptr<Texture> MaterialLibrary::make_clouds(double cover) const {
  const std::uint64_t seed = seed_of(seed_, "clouds");
  return std::make_unique<Texture>(512, 512, [=](double u, double v) {
    const double density = periodic_fractal(seed, 5 * u, 5 * v, 5, 7, 0.55) + 1.1 * (cover - 0.5);
    const double cloud = std::clamp(2.4 * density, 0.0, 1.0);
    const double underside = 0.25 * periodic_fractal(seed + 1, 9 * u, 9 * v, 9, 5, 0.6);
    return 0.42 + cloud * (0.45 - underside - 0.18 * cloud);
  });
}

std::unique_ptr<Texture> MaterialLibrary::make_cloud_detail() const {
  const std::uint64_t seed = seed_of(seed_, "cloud detail");
  return std::make_unique<Texture>(256, 256, [=](double u, double v) {
    return 0.5 + 0.06 * periodic_fractal(seed, 6 * u, 6 * v, 6, 5, 0.6);
  });
}

}  // namespace farpoint::tools::simulate
