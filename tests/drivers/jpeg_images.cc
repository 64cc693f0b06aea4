#include "tests/drivers/jpeg_images.h"

#include <cstdio>
#include <cstdlib>

#include <jpeglib.h>

namespace farpoint::test {

std::vector<std::uint8_t> jpeg_of(int width, int height, std::uint8_t grey) {
  jpeg_compress_struct encoder{};
  jpeg_error_mgr errors{};
  encoder.err = jpeg_std_error(&errors);
  jpeg_create_compress(&encoder);
  unsigned char* out = nullptr;
  unsigned long bytes = 0;
  jpeg_mem_dest(&encoder, &out, &bytes);
  encoder.image_width = static_cast<JDIMENSION>(width);
  encoder.image_height = static_cast<JDIMENSION>(height);
  encoder.input_components = 1;
  encoder.in_color_space = JCS_GRAYSCALE;
  jpeg_set_defaults(&encoder);
  jpeg_start_compress(&encoder, TRUE);
  std::vector<std::uint8_t> row(static_cast<std::size_t>(width), grey);
  for (JSAMPROW p = row.data(); encoder.next_scanline < encoder.image_height;)
    jpeg_write_scanlines(&encoder, &p, 1);
  jpeg_finish_compress(&encoder);
  std::vector<std::uint8_t> file(out, out + bytes);
  jpeg_destroy_compress(&encoder);
  std::free(out);
  return file;
}

}  // namespace farpoint::test
