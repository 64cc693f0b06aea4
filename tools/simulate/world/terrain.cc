// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/world/terrain.h"

#include <algorithm>
#include <cmath>

#include "tools/simulate/world/materials.h"
#include "tools/simulate/world/noise.h"
#include "tools/simulate/world/random.h"

namespace farpoint::tools::simulate {
namespace {

double smooth_step(double from, double to, double x) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

// Uneven ground begins here, beyond what belongs to the road.
constexpr double kVerge_m = 6.0;

}  // namespace

double Terrain::base(double x, double y) const {
  const double w = d_.relief_wavelength_m;
  return 0.5 * d_.relief_m * plane_fractal(seed_of(seed_, "base"), x / w, y / w, 2, 0.35);
}

double Terrain::height(double x, double y, double road_distance_m) const {
  double z = base(x, y);
  if (road_distance_m < kVerge_m) return z;
  const double rough = smooth_step(kVerge_m, 60.0, road_distance_m);
  z += rough * 0.8 * plane_fractal(seed_of(seed_, "rough"), x / 35.0, y / 35.0, 3);
  if (d_.hills_m > 0.0) {
    const double share = smooth_step(d_.hills_from_m, 3.0 * d_.hills_from_m + 100.0, road_distance_m);
    const double w = d_.hills_wavelength_m;
    if (share > 0.0)
      z += share * d_.hills_m * (0.45 + 0.8 * plane_fractal(seed_of(seed_, "hills"), x / w, y / w, 4));
  }
  if (d_.mountains_m > 0.0) {
    const double share = smooth_step(d_.mountains_from_m, 4.0 * d_.mountains_from_m + 300.0, road_distance_m);
    const double w = d_.mountains_wavelength_m;
    if (share > 0.0) z += share * d_.mountains_m * plane_ridges(seed_of(seed_, "mountains"), x / w, y / w, 6);
  }
  return z;
}

int Terrain::material(double x, double y, double height_m, double slope, double road_distance_m) const {
  const double above = height_m - base(x, y);
  if (slope > 0.75 || (d_.mountains_m > 0.0 && above > 0.45 * d_.mountains_m)) return kRock;
  const double wood = plane_fractal(seed_of(seed_, "forest"), x / 420.0, y / 420.0, 3);
  // About the share of places where the noise exceeds this bound.
  if (road_distance_m > 120.0 && wood > 0.62 * (0.5 - d_.forest_share)) return kForest;
  if (d_.cover == GroundCover::kGravel && road_distance_m < 40.0) return kGravel;
  return d_.cover == GroundCover::kFields && road_distance_m > 15.0 ? kFields : kGround;
}

}  // namespace farpoint::tools::simulate
