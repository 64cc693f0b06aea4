// SPDX-License-Identifier: Apache-2.0
// Images for the tests: made from formulas, or read from the recordings beside the project where they exist.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "slam/image/feature.h"

namespace farpoint::slam::testing {

struct OwnedImage {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
  OwnedImage() = default;
  OwnedImage(int w, int h, std::uint8_t value = 0)
      : width(w), height(h), pixels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), value) {}
  [[nodiscard]] std::uint8_t& at(int x, int y) {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
  [[nodiscard]] std::uint8_t at(int x, int y) const {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
  [[nodiscard]] ImageView view() const { return {pixels.data(), width, height, width}; }
};

// Uniform in [0, 1), the same on every standard library.
inline double uniform(std::mt19937_64& rng) {
  return static_cast<double>(rng() >> 11) * 0x1p-53;
}
// Standard normal (Box-Muller).
inline double normal(std::mt19937_64& rng) {
  return std::sqrt(-2 * std::log(1 - uniform(rng))) * std::cos(6.283185307179586 * uniform(rng));
}

// A smooth random texture that can be evaluated anywhere: waves of random direction, wavelengths from
// `shortest_px` to eight times that, mean 128 and standard deviation `contrast`.
class Texture {
 public:
  Texture(std::uint64_t seed, double shortest_px, double contrast) {
    std::mt19937_64 rng(seed);
    const double amplitude = contrast * std::sqrt(2.0 / kWaves);
    for (int i = 0; i < kWaves; ++i) {
      const double length = shortest_px * std::pow(8.0, uniform(rng));
      const double direction = 6.283185307179586 * uniform(rng), k = 6.283185307179586 / length;
      waves_.push_back(
          {k * std::cos(direction), k * std::sin(direction), 6.283185307179586 * uniform(rng), amplitude});
    }
  }
  [[nodiscard]] double operator()(double x, double y) const {
    double sum = 128;
    for (const Wave& w : waves_) sum += w.amplitude * std::sin(w.kx * x + w.ky * y + w.phase);
    return sum;
  }

 private:
  static constexpr int kWaves = 40;
  struct Wave {
    double kx, ky, phase, amplitude;
  };
  std::vector<Wave> waves_;
};

// Renders value(x, y) + noise, rounded and clipped.
inline OwnedImage render(int width, int height, const std::function<double(double, double)>& value,
                         double noise_sigma = 0, std::uint64_t seed = 1) {
  std::mt19937_64 rng(seed);
  OwnedImage image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double v = value(x, y) + (noise_sigma > 0 ? noise_sigma * normal(rng) : 0.0);
      image.at(x, y) = static_cast<std::uint8_t>(std::clamp(std::lround(v), 0L, 255L));
    }
  }
  return image;
}

// Overlapping random rectangles with a little noise: many true corners, strong and weak.
inline OwnedImage rectangles(int width, int height, int count, std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  OwnedImage image(width, height, 128);
  for (int i = 0; i < count; ++i) {
    const int x0 = static_cast<int>(uniform(rng) * width), y0 = static_cast<int>(uniform(rng) * height);
    const int w = 6 + static_cast<int>(uniform(rng) * 40), h = 6 + static_cast<int>(uniform(rng) * 40);
    const auto value = static_cast<std::uint8_t>(uniform(rng) * 256);
    for (int y = y0; y < std::min(height, y0 + h); ++y) {
      for (int x = x0; x < std::min(width, x0 + w); ++x) image.at(x, y) = value;
    }
  }
  for (std::uint8_t& p : image.pixels)
    p = static_cast<std::uint8_t>(std::clamp(p + std::lround(2 * normal(rng)), 0L, 255L));
  return image;
}

inline OwnedImage random_image(int width, int height, std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  OwnedImage image(width, height);
  for (std::uint8_t& p : image.pixels) p = static_cast<std::uint8_t>(rng() >> 56);
  return image;
}

// A frame of a recording below ../shared/data; empty (width 0) where the folder is absent.
[[nodiscard]] OwnedImage read_recorded(const std::string& path);
inline const std::string kKittiFrame = "kitti/sequences/03/image_0/";

}  // namespace farpoint::slam::testing
