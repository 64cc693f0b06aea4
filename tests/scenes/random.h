// SPDX-License-Identifier: Apache-2.0
// Seeded randomness of the simulator. The standard fixes its engines' sequences but not its distributions',
// so those are written out here: the same seed gives the same world with every compiler.
#pragma once

#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <random>

namespace farpoint::sim {

// SplitMix64 as an engine: cheap to seed, one stream for each sighting.
class SplitMix {
 public:
  explicit SplitMix(std::uint64_t seed) : state_(seed) {}
  std::uint64_t operator()() {
    state_ += 0x9e3779b97f4a7c15ULL;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }

 private:
  std::uint64_t state_;
};

// One seed out of several numbers.
inline std::uint64_t combine(std::initializer_list<std::uint64_t> values) {
  std::uint64_t h = 0x243f6a8885a308d3ULL;
  for (const std::uint64_t v : values) h = SplitMix(h ^ v)();
  return h;
}

template <typename Engine>
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : engine_(seed) {}

  std::uint64_t bits() { return engine_(); }
  // [0, 1)
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double log_uniform(double low, double high) { return low * std::exp(uniform() * std::log(high / low)); }
  bool chance(double probability) { return uniform() < probability; }
  // Standard normal, Box and Muller's transform.
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(6.283185307179586 * uniform());
  }

 private:
  Engine engine_;
};

using WorldDraw = Draw<std::mt19937_64>;  // worlds and motions
using SightingDraw = Draw<SplitMix>;      // noise of one sighting

}  // namespace farpoint::sim
