// SPDX-License-Identifier: Apache-2.0
// Small deterministic random generator for sampling matches. The standard library fixes its engines'
// sequences but not its distributions', so samples drawn with those would differ between compilers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace farpoint::slam {

// SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014).
class SampleGenerator {
 public:
  explicit SampleGenerator(uint64_t seed) : state_(seed) {}

  [[nodiscard]] uint64_t next() {
    state_ += 0x9e3779b97f4a7c15ULL;
    uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }

  // Evenly distributed index in [0, n), n < 2^32; the bias is below n / 2^32.
  [[nodiscard]] size_t index(size_t n) { return static_cast<size_t>(((next() >> 32) * n) >> 32); }

  // K different indices in [0, n). Precondition: n >= K.
  template <size_t K>
  [[nodiscard]] std::array<size_t, K> sample(size_t n) {
    std::array<size_t, K> chosen{};
    for (size_t i = 0; i < K; ++i) {
      bool taken = true;
      while (taken) {
        chosen[i] = index(n);
        taken = false;
        for (size_t k = 0; k < i; ++k) taken = taken || chosen[k] == chosen[i];
      }
    }
    return chosen;
  }

 private:
  uint64_t state_;
};

}  // namespace farpoint::slam
