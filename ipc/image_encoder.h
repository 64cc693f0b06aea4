// SPDX-License-Identifier: Apache-2.0
// 8-bit grey images to JPEG and PNG files, in memory. For tools and tests: takes memory from the heap.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace farpoint::ipc {

// Rows without gaps, row by row from the top. Owns nothing.
struct GreyPixels {
  int width_px = 0, height_px = 0;
  std::span<const std::uint8_t> pixels;  // width_px * height_px
};

// Baseline JPEG; quality 1 to 100. Throws std::runtime_error where the image has no size or too few pixels.
[[nodiscard]] std::vector<std::uint8_t> encode_jpeg(const GreyPixels& image, int quality);
// PNG, lossless. Throws as encode_jpeg does.
[[nodiscard]] std::vector<std::uint8_t> encode_png(const GreyPixels& image);

}  // namespace farpoint::ipc
