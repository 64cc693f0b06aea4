// SPDX-License-Identifier: Apache-2.0
// Pixels of a camera that never show the world: the bonnet, rotors, a frame around the lens.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace farpoint::slam {

// Immutable after construction: any thread may ask.
class ImageMask {
 public:
  // Largest masked share of an image: what is left of a smaller rest carries no pose.
  static constexpr double kMostShare = 0.9;

  // `pixels`: rows without gaps, row by row from the top; 0 is masked, every other value is not.
  // Precondition: width_px * height_px of them, both sides positive.
  ImageMask(int width_px, int height_px, std::span<const std::uint8_t> pixels);

  [[nodiscard]] int width_px() const { return width_px_; }
  [[nodiscard]] int height_px() const { return height_px_; }
  // Masked pixels, of all.
  [[nodiscard]] double share() const;
  // True where the square of half side `radius_px` around `pixel` reaches into a masked pixel. The part of
  // the square outside the image counts as unmasked, a pixel that is not finite as masked. Four memory reads
  // whatever the radius.
  [[nodiscard]] bool touches(const Eigen::Vector2d& pixel, double radius_px) const;
  [[nodiscard]] std::size_t bytes() const { return masked_before_.capacity() * sizeof(std::uint32_t); }

 private:
  [[nodiscard]] std::uint32_t masked_before(int x, int y) const {
    return masked_before_[static_cast<std::size_t>(y) * (static_cast<std::size_t>(width_px_) + 1) +
                          static_cast<std::size_t>(x)];
  }

  int width_px_, height_px_;
  // Summed-area table (Crow 1984): masked pixels left of column x and above row y, for x, y from 0 to the
  // side's length.
  std::vector<std::uint32_t> masked_before_;
};

}  // namespace farpoint::slam
