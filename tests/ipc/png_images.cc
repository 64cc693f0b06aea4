// SPDX-License-Identifier: Apache-2.0
#include "tests/ipc/png_images.h"

#include <algorithm>
#include <array>
#include <string_view>

#include <png.h>
#include <zlib.h>

namespace farpoint::test {
namespace {

using Bytes = std::vector<std::uint8_t>;

struct Layout {
  int type = 0, depth = 8;
};

Layout layout_of(PngKind kind) {
  switch (kind) {
    case PngKind::kGrey:
    case PngKind::kGreyInterlaced:
      return {PNG_COLOR_TYPE_GRAY, 8};
    case PngKind::kRgb:
    case PngKind::kRgbInterlaced:
      return {PNG_COLOR_TYPE_RGB, 8};
    case PngKind::kRgba:
    case PngKind::kRgbaInterlaced:
      return {PNG_COLOR_TYPE_RGB_ALPHA, 8};
    case PngKind::kGrey16:
    case PngKind::kGrey16Interlaced:
      return {PNG_COLOR_TYPE_GRAY, 16};
  }
  return {};
}

bool is_interlaced(PngKind kind) {
  return kind == PngKind::kGreyInterlaced || kind == PngKind::kRgbInterlaced ||
         kind == PngKind::kRgbaInterlaced || kind == PngKind::kGrey16Interlaced;
}

std::string big_endian_32(std::uint64_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 0xff);
  return bytes;
}

}  // namespace

std::vector<std::uint8_t> to_png(std::span<const std::uint8_t> pixels, int width_px, int height_px,
                                 PngKind kind) {
  Bytes out;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(
      png, &out,
      [](png_structp p, png_bytep data, std::size_t size) {
        auto* bytes = static_cast<Bytes*>(png_get_io_ptr(p));
        bytes->insert(bytes->end(), data, data + size);
      },
      nullptr);
  const Layout layout = layout_of(kind);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width_px), static_cast<png_uint_32>(height_px),
               layout.depth, layout.type, is_interlaced(kind) ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  const std::size_t row_bytes = png_get_rowbytes(png, info);
  const int passes = png_set_interlace_handling(png);
  for (int pass = 0; pass < passes; ++pass)
    for (int v = 0; v < height_px; ++v)
      png_write_row(png, pixels.subspan(static_cast<std::size_t>(v) * row_bytes, row_bytes).data());
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return out;
}

void put_png_chunk(const std::string& name, const std::vector<std::uint8_t>& content,
                   std::vector<std::uint8_t>* png) {
  constexpr std::size_t kHeadBytes = 8 + 25;  // signature, IHDR
  Bytes out(png->begin(), png->begin() + kHeadBytes);
  const auto put = [&out](std::string_view bytes) { out.insert(out.end(), bytes.begin(), bytes.end()); };
  const std::string named = name + std::string(content.begin(), content.end());
  put(big_endian_32(content.size()));
  put(named);
  put(big_endian_32(crc32(0, reinterpret_cast<const Bytef*>(named.data()), static_cast<uInt>(named.size()))));
  out.insert(out.end(), png->begin() + kHeadBytes, png->end());
  png->swap(out);
}

std::vector<std::uint8_t> deflated_zeros(std::size_t bytes) {
  z_stream stream{};
  deflateInit(&stream, Z_BEST_COMPRESSION);
  Bytes zeros(std::size_t{1} << 20, 0);
  std::array<std::uint8_t, 65536> piece{};
  Bytes out;
  std::size_t left = bytes;
  do {
    const std::size_t now = std::min(left, zeros.size());
    left -= now;
    stream.next_in = zeros.data();
    stream.avail_in = static_cast<uInt>(now);
    do {
      stream.next_out = piece.data();
      stream.avail_out = static_cast<uInt>(piece.size());
      deflate(&stream, left == 0 ? Z_FINISH : Z_NO_FLUSH);
      out.insert(out.end(), piece.data(), stream.next_out);
    } while (stream.avail_out == 0);
  } while (left > 0);
  deflateEnd(&stream);
  return out;
}

}  // namespace farpoint::test
