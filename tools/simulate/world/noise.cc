// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/world/noise.h"

#include <algorithm>
#include <cmath>

#include "tools/simulate/world/random.h"

namespace farpoint::tools::simulate {
namespace {

double fade(double t) {
  return t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
}

// Dot product of the lattice point's random direction with the offset from it.
double gradient(std::uint64_t hash, double dx, double dy) {
  // Eight directions suffice, and spare the sine of a random angle.
  constexpr double kDiagonal = 0.7071067811865476;
  constexpr double kX[8] = {1, kDiagonal, 0, -kDiagonal, -1, -kDiagonal, 0, kDiagonal};
  constexpr double kY[8] = {0, kDiagonal, 1, kDiagonal, 0, -kDiagonal, -1, -kDiagonal};
  const std::size_t i = hash >> 61;
  return kX[i] * dx + kY[i] * dy;
}

template <typename Hash>
double gradient_noise(double x, double y, const Hash& hash) {
  const double fx = std::floor(x), fy = std::floor(y);
  const auto ix = static_cast<std::int64_t>(fx), iy = static_cast<std::int64_t>(fy);
  const double dx = x - fx, dy = y - fy, u = fade(dx), v = fade(dy);
  const double a = gradient(hash(ix, iy), dx, dy), b = gradient(hash(ix + 1, iy), dx - 1, dy);
  const double c = gradient(hash(ix, iy + 1), dx, dy - 1), d = gradient(hash(ix + 1, iy + 1), dx - 1, dy - 1);
  const double low = a + u * (b - a), high = c + u * (d - c);
  return 1.5 * (low + v * (high - low));  // gradient noise stays within +-0.7
}

std::int64_t wrapped(std::int64_t i, int period) {
  if (i >= 0 && i < period) return i;  // nearly always, and far cheaper than a division
  const std::int64_t rest = i % period;
  return rest < 0 ? rest + period : rest;
}

}  // namespace

double plane_noise(std::uint64_t seed, double x, double y) {
  return gradient_noise(x, y, [seed](std::int64_t ix, std::int64_t iy) { return seed_at(seed, ix, iy); });
}

double plane_fractal(std::uint64_t seed, double x, double y, int octaves, double gain) {
  double sum = 0.0, height = 1.0, total = 0.0;
  for (int i = 0; i < octaves; ++i) {
    sum += height * plane_noise(seed + static_cast<std::uint64_t>(i), x, y);
    total += height;
    height *= gain;
    x *= 2.0;
    y *= 2.0;
  }
  return sum / total;
}

double plane_ridges(std::uint64_t seed, double x, double y, int octaves) {
  double sum = 0.0, height = 1.0, total = 0.0, weight = 1.0;
  for (int i = 0; i < octaves; ++i) {
    double ridge = 1.0 - std::abs(plane_noise(seed + static_cast<std::uint64_t>(i), x, y));
    ridge *= ridge * weight;
    weight = std::clamp(2.0 * ridge, 0.0, 1.0);  // detail gathers on the ridges (Musgrave)
    sum += height * ridge;
    total += height;
    height *= 0.5;
    x *= 2.0;
    y *= 2.0;
  }
  return sum / total;
}

double periodic_noise(std::uint64_t seed, double x, double y, int period) {
  return gradient_noise(x, y, [seed, period](std::int64_t ix, std::int64_t iy) {
    return seed_at(seed, wrapped(ix, period), wrapped(iy, period));
  });
}

double periodic_fractal(std::uint64_t seed, double x, double y, int period, int octaves, double gain) {
  double sum = 0.0, height = 1.0, total = 0.0;
  for (int i = 0; i < octaves; ++i) {
    sum += height * periodic_noise(seed + static_cast<std::uint64_t>(i), x, y, period);
    total += height;
    height *= gain;
    x *= 2.0;
    y *= 2.0;
    period *= 2;
  }
  return sum / total;
}

NoiseSheet::NoiseSheet(std::uint64_t seed, int period, int octaves, double gain) {
  const double scale = static_cast<double>(period) / kSide;
  values_.reserve(kSide * kSide);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x)
      values_.push_back(
          static_cast<float>(periodic_fractal(seed, x * scale, y * scale, period, octaves, gain)));
  }
}

double NoiseSheet::at(double u, double v) const {
  const double x = (u - std::floor(u)) * kSide, y = (v - std::floor(v)) * kSide;
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  const double a = x - ix, b = y - iy;
  const auto value = [this](int column, int row) {
    return static_cast<double>(
        values_[static_cast<std::size_t>((row & (kSide - 1)) * kSide + (column & (kSide - 1)))]);
  };
  return (1 - b) * ((1 - a) * value(ix, iy) + a * value(ix + 1, iy)) +
         b * ((1 - a) * value(ix, iy + 1) + a * value(ix + 1, iy + 1));
}

Cells periodic_cells(std::uint64_t seed, double x, double y, int period) {
  const auto cx = static_cast<std::int64_t>(std::floor(x)), cy = static_cast<std::int64_t>(std::floor(y));
  Cells cells{1e9, 1e9, 0};
  for (std::int64_t iy = cy - 1; iy <= cy + 1; ++iy) {
    for (std::int64_t ix = cx - 1; ix <= cx + 1; ++ix) {
      const std::uint64_t id = seed_at(seed, wrapped(ix, period), wrapped(iy, period));
      const double px = static_cast<double>(ix) + static_cast<double>(id & 0xffff) / 65536.0;
      const double py = static_cast<double>(iy) + static_cast<double>((id >> 16) & 0xffff) / 65536.0;
      const double square = (px - x) * (px - x) + (py - y) * (py - y);
      if (square < cells.nearest) {
        cells.second = cells.nearest;
        cells.nearest = square;
        cells.id = id;
      } else {
        cells.second = std::min(cells.second, square);
      }
    }
  }
  cells.nearest = std::sqrt(cells.nearest);
  cells.second = std::sqrt(cells.second);
  return cells;
}

}  // namespace farpoint::tools::simulate
