// SPDX-License-Identifier: Apache-2.0
#include "ipc/image_encoder.h"

#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include <jpeglib.h>
#include <png.h>

namespace farpoint::ipc {
namespace {

void require_pixels(const GreyPixels& image) {
  const bool has_size = image.width_px > 0 && image.height_px > 0;
  if (!has_size || image.pixels.size() <
                       static_cast<std::size_t>(image.width_px) * static_cast<std::size_t>(image.height_px))
    throw std::runtime_error("image: no pixels to encode");
}

const std::uint8_t* row_of(const GreyPixels& image, int row) {
  return image.pixels.data() + static_cast<std::ptrdiff_t>(row) * image.width_px;
}

// libjpeg's state and its way out of an error.
struct JpegWriter {
  jpeg_compress_struct encoder{};
  jpeg_error_mgr errors{};
  std::jmp_buf way_out{};
  unsigned char* bytes = nullptr;  // libjpeg's, by malloc
  unsigned long size = 0;

  [[noreturn]] static void leave(j_common_ptr common) {
    std::longjmp(static_cast<JpegWriter*>(common->client_data)->way_out, 1);
  }
  JpegWriter() {
    encoder.err = jpeg_std_error(&errors);
    errors.error_exit = leave;
    encoder.client_data = this;
  }
  ~JpegWriter() {
    jpeg_destroy_compress(&encoder);
    std::free(bytes);
  }
  JpegWriter(const JpegWriter&) = delete;
  JpegWriter& operator=(const JpegWriter&) = delete;

  [[nodiscard]] bool encode(const GreyPixels& image, int quality);
};

// No object with a destructor may live here: libjpeg leaves by longjmp.
bool JpegWriter::encode(const GreyPixels& image, int quality) {
  if (setjmp(way_out) != 0) return false;
  jpeg_create_compress(&encoder);
  jpeg_mem_dest(&encoder, &bytes, &size);
  encoder.image_width = static_cast<JDIMENSION>(image.width_px);
  encoder.image_height = static_cast<JDIMENSION>(image.height_px);
  encoder.input_components = 1;
  encoder.in_color_space = JCS_GRAYSCALE;
  jpeg_set_defaults(&encoder);
  jpeg_set_quality(&encoder, quality, TRUE);
  jpeg_start_compress(&encoder, TRUE);
  while (encoder.next_scanline < encoder.image_height) {
    // libjpeg reads the row; its interface lacks the const.
    JSAMPROW row = const_cast<JSAMPROW>(row_of(image, static_cast<int>(encoder.next_scanline)));
    jpeg_write_scanlines(&encoder, &row, 1);
  }
  jpeg_finish_compress(&encoder);
  return true;
}

}  // namespace

std::vector<std::uint8_t> encode_jpeg(const GreyPixels& image, int quality) {
  require_pixels(image);
  JpegWriter writer;
  if (!writer.encode(image, quality)) throw std::runtime_error("image: libjpeg cannot encode it");
  return {writer.bytes, writer.bytes + writer.size};
}

std::vector<std::uint8_t> encode_png(const GreyPixels& image) {
  require_pixels(image);
  png_image head{};
  head.version = PNG_IMAGE_VERSION;
  head.width = static_cast<png_uint_32>(image.width_px);
  head.height = static_cast<png_uint_32>(image.height_px);
  head.format = PNG_FORMAT_GRAY;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(head);
  std::vector<std::uint8_t> bytes(size);
  constexpr int kFullRange = 0, kRowsWithoutGaps = 0;
  if (png_image_write_to_memory(&head, bytes.data(), &size, kFullRange, image.pixels.data(), kRowsWithoutGaps,
                                nullptr) == 0)
    throw std::runtime_error(std::string("image: ") + head.message);
  bytes.resize(size);
  return bytes;
}

}  // namespace farpoint::ipc
