// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/world/texture.h"

#include <algorithm>
#include <cmath>

namespace farpoint::tools::simulate {
namespace {

std::uint8_t to_texel(float value) {
  return static_cast<std::uint8_t>(std::lround(255.0F * std::clamp(value, 0.0F, 1.0F)));
}

TextureLevel make_level(int width, int height, const std::vector<float>& values) {
  TextureLevel level;
  level.width = width;
  level.height = height;
  level.stride = width + TextureLevel::kRowPadding;
  level.texels.resize(static_cast<std::size_t>(level.stride) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < level.stride; ++x) {
      level.texels[static_cast<std::size_t>(y * level.stride + x)] =
          to_texel(values[static_cast<std::size_t>(y * width + x % width)]);
    }
  }
  return level;
}

std::vector<float> halved(int width, int height, const std::vector<float>& values) {
  const int w = std::max(width / 2, 1), h = std::max(height / 2, 1);
  std::vector<float> result(static_cast<std::size_t>(w * h));
  const auto at = [&](int x, int y) {
    return values[static_cast<std::size_t>(std::min(y, height - 1) * width + std::min(x, width - 1))];
  };
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      result[static_cast<std::size_t>(y * w + x)] =
          0.25F * (at(2 * x, 2 * y) + at(2 * x + 1, 2 * y) + at(2 * x, 2 * y + 1) + at(2 * x + 1, 2 * y + 1));
    }
  }
  return result;
}

double covered_share(const TextureLevel& level) {
  std::size_t covered = 0;
  for (int y = 0; y < level.height; ++y) {
    for (int x = 0; x < level.width; ++x) covered += level.at(x, y) >= 128 ? 1 : 0;
  }
  return static_cast<double>(covered) / (static_cast<double>(level.width) * level.height);
}

}  // namespace

Texture::Texture(int width, int height, const std::vector<float>& values) {
  build(width, height, values);
}

Texture::Texture(int width, int height, const std::function<double(double, double)>& value) {
  std::vector<float> values(static_cast<std::size_t>(width * height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      values[static_cast<std::size_t>(y * width + x)] =
          static_cast<float>(value((x + 0.5) / width, (y + 0.5) / height));
    }
  }
  build(width, height, values);
}

void Texture::build(int width, int height, const std::vector<float>& values) {
  std::vector<float> current = values;
  for (float& v : current) v = std::clamp(v, 0.0F, 1.0F);
  double sum = 0.0;
  for (const float v : current) sum += v;
  mean_ = 255.0 * sum / static_cast<double>(current.size());
  levels_.push_back(make_level(width, height, current));
  while (width > 1 || height > 1) {
    current = halved(width, height, current);
    width = std::max(width / 2, 1);
    height = std::max(height / 2, 1);
    levels_.push_back(make_level(width, height, current));
  }
}

void Texture::keep_coverage() {
  const double wanted = covered_share(levels_[0]);
  for (std::size_t i = 1; i < levels_.size(); ++i) {
    TextureLevel& level = levels_[i];
    std::vector<std::uint8_t> sorted;
    for (int y = 0; y < level.height; ++y) {
      for (int x = 0; x < level.width; ++x) sorted.push_back(level.at(x, y));
    }
    std::sort(sorted.begin(), sorted.end());
    const auto rank = static_cast<std::size_t>((1.0 - wanted) * static_cast<double>(sorted.size()));
    const int cut = sorted[std::min(rank, sorted.size() - 1)];
    for (std::uint8_t& texel : level.texels) {
      texel = static_cast<std::uint8_t>(std::clamp(texel + 128 - cut, 0, 255));
    }
  }
}

float Texture::sample(int level_index, float u, float v) const {
  const TextureLevel& level = levels_[static_cast<std::size_t>(level_index)];
  const float x = u * static_cast<float>(level.width) - 0.5F;
  const float y = v * static_cast<float>(level.height) - 0.5F;
  const float fx = std::floor(x), fy = std::floor(y);
  const int ix = static_cast<int>(fx), iy = static_cast<int>(fy);
  const float ax = x - fx, ay = y - fy;
  const float top =
      static_cast<float>(level.at(ix, iy)) * (1 - ax) + static_cast<float>(level.at(ix + 1, iy)) * ax;
  const float bottom =
      static_cast<float>(level.at(ix, iy + 1)) * (1 - ax) + static_cast<float>(level.at(ix + 1, iy + 1)) * ax;
  return top * (1 - ay) + bottom * ay;
}

}  // namespace farpoint::tools::simulate
