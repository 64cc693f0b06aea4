// SPDX-License-Identifier: Apache-2.0
#include "slam/geometry/image_mask.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace farpoint::slam {

ImageMask::ImageMask(int width_px, int height_px, std::span<const std::uint8_t> pixels)
    : width_px_(width_px), height_px_(height_px) {
  const auto width = static_cast<std::size_t>(width_px), height = static_cast<std::size_t>(height_px);
  assert(width_px > 0 && height_px > 0 && pixels.size() == width * height);
  masked_before_.assign((width + 1) * (height + 1), 0);
  for (std::size_t y = 0; y < height; ++y) {
    const std::uint32_t* above = masked_before_.data() + y * (width + 1);
    std::uint32_t* here = masked_before_.data() + (y + 1) * (width + 1);
    std::uint32_t in_row = 0;
    for (std::size_t x = 0; x < width; ++x) {
      in_row += pixels[y * width + x] == 0 ? 1U : 0U;
      here[x + 1] = above[x + 1] + in_row;
    }
  }
}

double ImageMask::share() const {
  return static_cast<double>(masked_before(width_px_, height_px_)) /
         (static_cast<double>(width_px_) * static_cast<double>(height_px_));
}

bool ImageMask::touches(const Eigen::Vector2d& pixel, double radius_px) const {
  if (!pixel.allFinite()) return true;
  // Whole pixels that the square reaches: their centres are whole numbers. Clamped before the conversion, as
  // a pixel may lie anywhere.
  const auto from = [radius_px](double centre, int side) {
    return static_cast<int>(std::clamp(std::floor(centre - radius_px), 0.0, static_cast<double>(side)));
  };
  const auto to = [radius_px](double centre, int side) {
    return static_cast<int>(std::clamp(std::ceil(centre + radius_px) + 1.0, 0.0, static_cast<double>(side)));
  };
  const int x0 = from(pixel.x(), width_px_), x1 = to(pixel.x(), width_px_);
  const int y0 = from(pixel.y(), height_px_), y1 = to(pixel.y(), height_px_);
  if (x0 >= x1 || y0 >= y1) return false;
  return masked_before(x1, y1) - masked_before(x0, y1) - masked_before(x1, y0) + masked_before(x0, y0) != 0;
}

}  // namespace farpoint::slam
