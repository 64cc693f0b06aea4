// SPDX-License-Identifier: Apache-2.0
#include "tests/ipc/jpeg_images.h"

#include <cstdio>
#include <cstdlib>

#include <jpeglib.h>

namespace farpoint::test {

std::vector<std::uint8_t> to_jpeg(std::span<const std::uint8_t> pixels, int width_px, int height_px,
                                  int channels, bool progressive) {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* out = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &out, &size);
  jpeg.image_width = static_cast<JDIMENSION>(width_px);
  jpeg.image_height = static_cast<JDIMENSION>(height_px);
  jpeg.input_components = channels;
  jpeg.in_color_space = channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, 95, TRUE);
  if (progressive) jpeg_simple_progression(&jpeg);
  jpeg_start_compress(&jpeg, TRUE);
  while (jpeg.next_scanline < jpeg.image_height) {
    JSAMPROW row =
        const_cast<JSAMPROW>(pixels.data() + jpeg.next_scanline * static_cast<unsigned>(width_px * channels));
    jpeg_write_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_compress(&jpeg);
  jpeg_destroy_compress(&jpeg);
  std::vector<std::uint8_t> bytes(out, out + size);
  std::free(out);
  return bytes;
}

std::vector<std::uint8_t> plain_jpeg(int width_px, int height_px, std::uint8_t grey) {
  const std::size_t pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  return to_jpeg(std::vector<std::uint8_t>(pixels, grey), width_px, height_px, 1);
}

}  // namespace farpoint::test
