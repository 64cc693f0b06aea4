// SPDX-License-Identifier: Apache-2.0
// Decodes image bytes to 8-bit grey. Damaged bytes neither throw nor crash; only lack of memory throws. The
// memory of one image is bounded (ImageDecoder::kMaxWorkingBytes, kMaxBytesAPixel).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "farpoint/image_t.hpp"
#include "ipc/decode_arena.h"

namespace farpoint::ipc {

// Rows without gaps, row by row from the top.
struct GreyImage {
  int width_px = 0, height_px = 0;
  std::vector<std::uint8_t> pixels;  // width_px * height_px

  [[nodiscard]] const std::uint8_t* data() const { return pixels.data(); }
};

enum class ImageStatus : std::uint8_t {
  kOk,
  kWrongSize,      // the size differs from the message's, or grey bytes are missing
  kUnknownFormat,  // a pixel format outside image_t's
  kDamaged,        // the JPEG or PNG cannot be decoded in full
  kTooLarge,       // more pixels or more working memory than the decoder's limit
};
[[nodiscard]] const char* to_string(ImageStatus status);

// Format and size from an image file's header.
struct ImageInfo {
  std::int32_t pixel_format = 0;  // image_t::PIXEL_FORMAT_MJPEG or PIXEL_FORMAT_PNG
  int width_px = 0, height_px = 0;
};
// Reads the header of a JPEG or PNG file. Empty for other files and ones cut off before the size.
[[nodiscard]] std::optional<ImageInfo> probe_image(std::span<const std::uint8_t> file);

inline constexpr int kMaxImageSide_px = 16384;
inline constexpr std::int64_t kMaxImagePixels = std::int64_t{64} << 20;

// Keeps the decoders' working memory from image to image: no heap call after the first images, except for
// progressive JPEGs, which are decoded as a whole. Text and colour profiles of PNG files are skipped or
// bounded. Not thread-safe: one instance a thread.
class ImageDecoder {
 public:
  // Most working memory of one image. Decoders work row by row; a progressive JPEG is decoded as a whole and
  // may take kMaxBytesAPixel more for each pixel (three full-size components take 6).
  static constexpr std::size_t kMaxWorkingBytes = std::size_t{4} << 20, kMaxBytesAPixel = 8;

  // Larger images are kTooLarge.
  explicit ImageDecoder(std::int64_t most_pixels = kMaxImagePixels);
  ~ImageDecoder();
  ImageDecoder(const ImageDecoder&) = delete;
  ImageDecoder& operator=(const ImageDecoder&) = delete;

  // Decodes the first message.size bytes of message.data. Colour becomes luma, 16 bit becomes 8. On any
  // status except kOk the image's content is unspecified.
  [[nodiscard]] ImageStatus decode(const image_t& message, GreyImage* image);
  // Decodes one JPEG file of this size from any memory, such as a camera's buffer.
  [[nodiscard]] ImageStatus decode_jpeg(std::span<const std::uint8_t> file, int width_px, int height_px,
                                        GreyImage* image);
  // Working memory kept from image to image.
  [[nodiscard]] std::size_t working_bytes() const { return arena_.bytes(); }

 private:
  struct Jpeg;
  std::int64_t most_pixels_;
  DecodeArena arena_;  // of the image being decoded
  std::unique_ptr<Jpeg> jpeg_;
};

}  // namespace farpoint::ipc
