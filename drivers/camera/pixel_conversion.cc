// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/pixel_conversion.h"

#include <cstring>

namespace farpoint::drivers {
namespace {

bool has_all_rows(std::span<const std::uint8_t> bytes, const PixelLayout& layout, int bytes_a_pixel) {
  const std::int64_t row_bytes = std::int64_t{layout.width_px} * bytes_a_pixel;
  if (layout.width_px <= 0 || layout.height_px <= 0 || layout.row_stride < row_bytes) return false;
  const std::int64_t needed = std::int64_t{layout.row_stride} * (layout.height_px - 1) + row_bytes;
  return static_cast<std::int64_t>(bytes.size()) >= needed;
}

void set_size(const PixelLayout& layout, ipc::GreyImage* image) {
  image->width_px = layout.width_px;
  image->height_px = layout.height_px;
  image->pixels.resize(static_cast<std::size_t>(layout.width_px) *
                       static_cast<std::size_t>(layout.height_px));
}

}  // namespace

bool grey_rows_to_grey(std::span<const std::uint8_t> bytes, const PixelLayout& layout,
                       ipc::GreyImage* image) {
  if (!has_all_rows(bytes, layout, 1)) return false;
  set_size(layout, image);
  const auto width = static_cast<std::size_t>(layout.width_px),
             stride = static_cast<std::size_t>(layout.row_stride);
  for (std::size_t row = 0; row < static_cast<std::size_t>(layout.height_px); ++row)
    std::memcpy(image->pixels.data() + row * width, bytes.data() + row * stride, width);
  return true;
}

bool yuyv_to_grey(std::span<const std::uint8_t> bytes, const PixelLayout& layout, ipc::GreyImage* image) {
  if (!has_all_rows(bytes, layout, 2)) return false;
  set_size(layout, image);
  const auto width = static_cast<std::size_t>(layout.width_px),
             stride = static_cast<std::size_t>(layout.row_stride);
  for (std::size_t row = 0; row < static_cast<std::size_t>(layout.height_px); ++row) {
    const std::uint8_t* from = bytes.data() + row * stride;
    std::uint8_t* to = image->pixels.data() + row * width;
    for (std::size_t x = 0; x < width; ++x) to[x] = from[2 * x];
  }
  return true;
}

bool rgb24_to_grey(std::span<const std::uint8_t> bytes, const PixelLayout& layout, ipc::GreyImage* image) {
  if (!has_all_rows(bytes, layout, 3)) return false;
  set_size(layout, image);
  // 0.299, 0.587 and 0.114 in 256ths: in all 256, so that white stays white.
  constexpr unsigned kRed = 77, kGreen = 150, kBlue = 29, kHalf = 128;
  const auto width = static_cast<std::size_t>(layout.width_px),
             stride = static_cast<std::size_t>(layout.row_stride);
  for (std::size_t row = 0; row < static_cast<std::size_t>(layout.height_px); ++row) {
    const std::uint8_t* from = bytes.data() + row * stride;
    std::uint8_t* to = image->pixels.data() + row * width;
    for (std::size_t x = 0; x < width; ++x) {
      const unsigned sum = kRed * from[3 * x] + kGreen * from[3 * x + 1] + kBlue * from[3 * x + 2];
      to[x] = static_cast<std::uint8_t>((sum + kHalf) >> 8U);
    }
  }
  return true;
}

double mean_grey(const ipc::GreyImage& image) {
  constexpr int kStep = 8;
  std::int64_t sum = 0, count = 0;
  for (int y = kStep / 2; y < image.height_px; y += kStep) {
    const std::uint8_t* row = image.data() + static_cast<std::ptrdiff_t>(y) * image.width_px;
    for (int x = kStep / 2; x < image.width_px; x += kStep, ++count) sum += row[x];
  }
  return count > 0 ? static_cast<double>(sum) / static_cast<double>(count) : 0.0;
}

}  // namespace farpoint::drivers
