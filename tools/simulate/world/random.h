// SPDX-License-Identifier: Apache-2.0
// Randomness of the simulated world. Everything random is a function of the seed and of a name or place,
// never of the order in which things are made: a tile of the world looks the same whenever it is built.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string_view>

namespace farpoint::tools::simulate {

// Finaliser of SplitMix64: every bit of the result depends on every bit of the input.
[[nodiscard]] inline std::uint64_t mix(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

[[nodiscard]] inline std::uint64_t combine(std::uint64_t a, std::uint64_t b) {
  return mix(a * 0x9e3779b97f4a7c15ULL + b + 0x632be59bd9b4e019ULL);
}

// Seed of a part of the world by its name.
[[nodiscard]] inline std::uint64_t seed_of(std::uint64_t seed, std::string_view name) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;  // FNV-1a
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  return combine(seed, hash);
}

// Seed of a place of a lattice. In the inner loop of all noise: one finaliser for both coordinates.
[[nodiscard]] inline std::uint64_t seed_at(std::uint64_t seed, std::int64_t x, std::int64_t y) {
  return mix(seed + static_cast<std::uint64_t>(x) * 0x9e3779b97f4a7c15ULL +
             static_cast<std::uint64_t>(y) * 0xd1b54a32d192ed03ULL + 0x632be59bd9b4e019ULL);
}

class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  [[nodiscard]] std::uint64_t bits() {
    state_ += 0x9e3779b97f4a7c15ULL;
    return mix(state_);
  }
  // In [0, 1).
  [[nodiscard]] double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  [[nodiscard]] double uniform(double low, double high) { return low + (high - low) * uniform(); }
  // In [0, n).
  [[nodiscard]] int index(int n) {
    return static_cast<int>(((bits() >> 32) * static_cast<std::uint64_t>(n)) >> 32);
  }
  [[nodiscard]] bool chance(double probability) { return uniform() < probability; }
  // Mean 0, standard deviation 1 (Box-Muller).
  [[nodiscard]] double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

 private:
  std::uint64_t state_;
};

}  // namespace farpoint::tools::simulate
