// SPDX-License-Identifier: Apache-2.0
// Smooth noise: of the plane for terrain, periodic for textures.
#pragma once

#include <cstdint>
#include <vector>

namespace farpoint::tools::simulate {

// Value in about [-1, 1], mean 0, one bump a unit; twice differentiable (quintic fade, Perlin 2002).
[[nodiscard]] double plane_noise(std::uint64_t seed, double x, double y);
// Sum of octaves, each of half the size and `gain` times the height; about [-1, 1].
[[nodiscard]] double plane_fractal(std::uint64_t seed, double x, double y, int octaves, double gain = 0.5);
// Ridges like those of mountains: [0, 1], sharp at the top.
[[nodiscard]] double plane_ridges(std::uint64_t seed, double x, double y, int octaves);

// Noise that repeats after `period` units in both directions; [-1, 1].
[[nodiscard]] double periodic_noise(std::uint64_t seed, double x, double y, int period);
[[nodiscard]] double periodic_fractal(std::uint64_t seed, double x, double y, int period, int octaves,
                                      double gain = 0.5);

// A sheet of periodic fractal noise, made once and looked up many times: dirt is dirt wherever it sticks.
class NoiseSheet {
 public:
  NoiseSheet(std::uint64_t seed, int period, int octaves, double gain);
  // Repeats every unit; interpolated.
  [[nodiscard]] double at(double u, double v) const;

 private:
  static constexpr int kSide = 512;
  std::vector<float> values_;
};

// Nearest of points strewn one a cell, periodic: distances to the nearest and the second nearest, and a
// number that tells the nearest from the others. Pebbles, stones, tree crowns from above.
struct Cells {
  double nearest = 0.0, second = 0.0;
  std::uint64_t id = 0;
};
[[nodiscard]] Cells periodic_cells(std::uint64_t seed, double x, double y, int period);

}  // namespace farpoint::tools::simulate
