// SPDX-License-Identifier: Apache-2.0
// Converts pixel layouts of cameras to 8-bit grey in one pass, front to back, since the driver's memory may
// be uncached. Returns false for too few bytes; the image is then unchanged.
#pragma once

#include <cstdint>
#include <span>

#include "ipc/image_codec.h"

namespace farpoint::drivers {

struct PixelLayout {
  int width_px = 0, height_px = 0;
  int row_stride = 0;  // bytes from row to row of the source
};

// GREY, and the luma of NV12, which comes first in the same layout.
[[nodiscard]] bool grey_rows_to_grey(std::span<const std::uint8_t> bytes, const PixelLayout& layout,
                                     ipc::GreyImage* image);
// Y0 U Y1 V: every other byte.
[[nodiscard]] bool yuyv_to_grey(std::span<const std::uint8_t> bytes, const PixelLayout& layout,
                                ipc::GreyImage* image);
// Red, green, blue, a byte each: their luma (ITU-R BT.601), rounded.
[[nodiscard]] bool rgb24_to_grey(std::span<const std::uint8_t> bytes, const PixelLayout& layout,
                                 ipc::GreyImage* image);

// Mean over a coarse grid, the input of exposure control.
[[nodiscard]] double mean_grey(const ipc::GreyImage& image);

}  // namespace farpoint::drivers
