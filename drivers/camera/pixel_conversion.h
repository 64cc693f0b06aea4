// The cameras' pixel layouts to 8-bit grey: one pass over the driver's memory, front to back, since that may
// be uncached. False where the bytes are too few; the image is then untouched.
#pragma once

#include <cstdint>
#include <span>

#include "ipc/image_codec.h"

namespace farpoint::drivers {

struct PixelLayout {
  int width_px = 0, height_px = 0;
  int row_stride = 0;  // bytes from row to row of the source
};

// GREY, and the luma of NV12, which lies in front as just such rows.
[[nodiscard]] bool grey_rows_to_grey(std::span<const std::uint8_t> bytes, const PixelLayout& layout,
                                     ipc::GreyImage* image);
// Y0 U Y1 V: every other byte.
[[nodiscard]] bool yuyv_to_grey(std::span<const std::uint8_t> bytes, const PixelLayout& layout,
                                ipc::GreyImage* image);
// Red, green, blue, a byte each: their luma (ITU-R BT.601), rounded.
[[nodiscard]] bool rgb24_to_grey(std::span<const std::uint8_t> bytes, const PixelLayout& layout,
                                 ipc::GreyImage* image);

// Mean over a coarse grid: what an exposure control needs of an image.
[[nodiscard]] double mean_grey(const ipc::GreyImage& image);

}  // namespace farpoint::drivers
