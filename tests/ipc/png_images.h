// SPDX-License-Identifier: Apache-2.0
// PNG images for tests.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace farpoint::test {

enum class PngKind : std::uint8_t {
  kGrey,
  kGreyInterlaced,
  kRgb,
  kRgbInterlaced,
  kRgba,
  kRgbaInterlaced,
  kGrey16,
  kGrey16Interlaced
};

// Rows without gaps, with the channels and bytes of the kind.
[[nodiscard]] std::vector<std::uint8_t> to_png(std::span<const std::uint8_t> pixels, int width_px,
                                               int height_px, PngKind kind);
// Puts a chunk with its length and checksum behind the header of a PNG file.
void put_png_chunk(const std::string& name, const std::vector<std::uint8_t>& content,
                   std::vector<std::uint8_t>* png);
// Zeros, compressed as chunks are.
[[nodiscard]] std::vector<std::uint8_t> deflated_zeros(std::size_t bytes);

}  // namespace farpoint::test
