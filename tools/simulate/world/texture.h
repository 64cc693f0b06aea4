// SPDX-License-Identifier: Apache-2.0
// Mip-mapped grey textures that repeat in both directions.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace farpoint::tools::simulate {

// One resolution. Rows are stored with a few texels of their own beginning behind their end, so that a 32-bit
// load at any texel holds its right neighbour too.
struct TextureLevel {
  static constexpr int kRowPadding = 4;
  int width = 0, height = 0;  // powers of two
  int stride = 0;
  std::vector<std::uint8_t> texels;

  [[nodiscard]] std::uint8_t at(int x, int y) const {
    const int index = (y & (height - 1)) * stride + (x & (width - 1));
    return texels[static_cast<std::size_t>(index)];
  }
};

// Reflectance is linear in the texel: halving the resolution averages light as a lens does.
class Texture {
 public:
  // Values of [0, 1], row by row; width and height are powers of two.
  Texture(int width, int height, const std::vector<float>& values);
  Texture(int width, int height, const std::function<double(double u, double v)>& value);

  [[nodiscard]] int levels() const { return static_cast<int>(levels_.size()); }
  [[nodiscard]] const TextureLevel& level(int i) const { return levels_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] int width() const { return levels_[0].width; }
  [[nodiscard]] int height() const { return levels_[0].height; }
  [[nodiscard]] double mean() const { return mean_; }  // of [0, 255]
  // Keeps the share of texels above one half from level to level, so that a cut-out (foliage) neither melts
  // away nor closes with distance.
  void keep_coverage();

  // Bilinear, of [0, 255]; u and v count repetitions.
  [[nodiscard]] float sample(int level, float u, float v) const;

 private:
  void build(int width, int height, const std::vector<float>& values);

  std::vector<TextureLevel> levels_;
  double mean_ = 0.0;
};

}  // namespace farpoint::tools::simulate
