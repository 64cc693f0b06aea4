// SPDX-License-Identifier: Apache-2.0
#include "ipc/image_codec.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>

#include <png.h>
#include <zlib.h>

#include "tests/ipc/jpeg_images.h"

namespace farpoint::ipc {
namespace {

using test::to_jpeg;
using Bytes = std::vector<std::uint8_t>;

// A smooth picture: JPEG keeps it within a few grey levels.
Bytes picture(int width_px, int height_px, int channels) {
  Bytes out;
  for (int v = 0; v < height_px; ++v) {
    for (int u = 0; u < width_px; ++u) {
      for (int c = 0; c < channels; ++c) {
        out.push_back(static_cast<std::uint8_t>(128 + 100 * std::sin(0.05 * u + 0.08 * v + c)));
      }
    }
  }
  return out;
}

Bytes to_png(const Bytes& pixels, int width_px, int height_px, int type, int depth, int interlace) {
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
  png_set_IHDR(png, info, png_uint_32(width_px), png_uint_32(height_px), depth, type, interlace,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  const std::size_t row_bytes = png_get_rowbytes(png, info);
  std::vector<png_bytep> rows;
  for (int v = 0; v < height_px; ++v) {
    rows.push_back(const_cast<png_bytep>(pixels.data()) + static_cast<std::size_t>(v) * row_bytes);
  }
  png_write_image(png, rows.data());
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return out;
}

image_t message(std::int32_t format, int width_px, int height_px, Bytes data) {
  image_t out{};
  out.pixel_format = format;
  out.width = width_px;
  out.height = height_px;
  out.size = static_cast<std::int32_t>(data.size());
  out.data = std::move(data);
  return out;
}

int largest_difference(const Bytes& a, const Bytes& b) {
  int worst = a.size() == b.size() ? 0 : 1000;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    worst = std::max(worst, std::abs(a[i] - b[i]));
  return worst;
}

TEST(ImageCodec, GreyIsCopiedWithoutItsPadding) {
  image_t in = message(image_t::PIXEL_FORMAT_GREY, 3, 2, {1, 2, 3, 99, 4, 5, 6});
  in.row_stride = 4;
  ImageDecoder decoder;
  GreyImage image;
  ASSERT_EQ(decoder.decode(in, &image), ImageStatus::kOk);
  EXPECT_EQ(image.pixels, (Bytes{1, 2, 3, 4, 5, 6}));
  in.row_stride = 0;
  in.size = 6;
  ASSERT_EQ(decoder.decode(in, &image), ImageStatus::kOk);
  EXPECT_EQ(image.pixels, (Bytes{1, 2, 3, 99, 4, 5}));
}

TEST(ImageCodec, GreyOfImpossibleSizeIsRefused) {
  ImageDecoder decoder;
  GreyImage image;
  const Bytes data(6);
  EXPECT_EQ(decoder.decode(message(image_t::PIXEL_FORMAT_GREY, 4, 2, data), &image), ImageStatus::kWrongSize);
  EXPECT_EQ(decoder.decode(message(image_t::PIXEL_FORMAT_GREY, -3, -2, data), &image),
            ImageStatus::kWrongSize);
  EXPECT_EQ(decoder.decode(message(image_t::PIXEL_FORMAT_GREY, 0, 2, data), &image), ImageStatus::kWrongSize);
  EXPECT_EQ(decoder.decode(message(image_t::PIXEL_FORMAT_GREY, INT32_MAX, INT32_MAX, data), &image),
            ImageStatus::kWrongSize);
  image_t in = message(image_t::PIXEL_FORMAT_GREY, 3, 2, data);
  in.row_stride = -3;
  EXPECT_EQ(decoder.decode(in, &image), ImageStatus::kWrongSize);
  in.row_stride = 0;
  in.size = -1;
  EXPECT_EQ(decoder.decode(in, &image), ImageStatus::kWrongSize);
  in.size = INT32_MAX;  // more than there is
  EXPECT_EQ(decoder.decode(in, &image), ImageStatus::kOk);
  in.pixel_format = 5;
  EXPECT_EQ(decoder.decode(in, &image), ImageStatus::kUnknownFormat);
}

TEST(ImageCodec, JpegGreyColourProgressive) {
  ImageDecoder decoder;
  GreyImage image;
  const Bytes grey = picture(83, 41, 1);
  for (const bool progressive : {false, true}) {
    const image_t in = message(image_t::PIXEL_FORMAT_MJPEG, 83, 41, to_jpeg(grey, 83, 41, 1, progressive));
    ASSERT_EQ(decoder.decode(in, &image), ImageStatus::kOk);
    EXPECT_LE(largest_difference(image.pixels, grey), 6);
  }
  Bytes equal_rgb;
  for (const std::uint8_t value : grey) equal_rgb.insert(equal_rgb.end(), 3, value);
  const image_t in = message(image_t::PIXEL_FORMAT_MJPEG, 83, 41, to_jpeg(equal_rgb, 83, 41, 3));
  ASSERT_EQ(decoder.decode(in, &image), ImageStatus::kOk);
  EXPECT_LE(largest_difference(image.pixels, grey), 6);
}

TEST(ImageCodec, PngOfEveryKind) {
  ImageDecoder decoder;
  GreyImage image;
  const int width_px = 37, height_px = 23;
  const Bytes grey = picture(width_px, height_px, 1);
  Bytes rgb, rgba, grey16;
  for (const std::uint8_t value : grey) {
    rgb.insert(rgb.end(), 3, value);
    rgba.insert(rgba.end(), {value, value, value, 200});
    grey16.insert(grey16.end(), {value, value});
  }
  for (const int interlace : {PNG_INTERLACE_NONE, PNG_INTERLACE_ADAM7}) {
    for (const auto& [pixels, type, depth] :
         {std::tuple{grey, PNG_COLOR_TYPE_GRAY, 8}, std::tuple{rgb, PNG_COLOR_TYPE_RGB, 8},
          std::tuple{rgba, PNG_COLOR_TYPE_RGB_ALPHA, 8}, std::tuple{grey16, PNG_COLOR_TYPE_GRAY, 16}}) {
      const image_t in = message(image_t::PIXEL_FORMAT_PNG, width_px, height_px,
                                 to_png(pixels, width_px, height_px, type, depth, interlace));
      ASSERT_EQ(decoder.decode(in, &image), ImageStatus::kOk) << type << " " << depth;
      EXPECT_LE(largest_difference(image.pixels, grey), 1) << type << " " << depth;
    }
  }
}

TEST(ImageCodec, AnotherSizeThanTheMessageSaysIsRefused) {
  ImageDecoder decoder;
  GreyImage image;
  const Bytes grey = picture(40, 30, 1);
  EXPECT_EQ(decoder.decode(message(image_t::PIXEL_FORMAT_MJPEG, 41, 30, to_jpeg(grey, 40, 30, 1)), &image),
            ImageStatus::kWrongSize);
  EXPECT_EQ(decoder.decode(message(image_t::PIXEL_FORMAT_PNG, 40, 31,
                                   to_png(grey, 40, 30, PNG_COLOR_TYPE_GRAY, 8, PNG_INTERLACE_NONE)),
                           &image),
            ImageStatus::kWrongSize);
}

TEST(ImageCodec, ProbeTellsSizeAndKind) {
  const Bytes grey = picture(40, 30, 1);
  const auto jpeg = probe_image(to_jpeg(grey, 40, 30, 1));
  ASSERT_TRUE(jpeg);
  EXPECT_EQ(jpeg->pixel_format, +image_t::PIXEL_FORMAT_MJPEG);
  EXPECT_EQ(jpeg->width_px, 40);
  EXPECT_EQ(jpeg->height_px, 30);
  const auto png = probe_image(to_png(grey, 40, 30, PNG_COLOR_TYPE_GRAY, 8, PNG_INTERLACE_NONE));
  ASSERT_TRUE(png);
  EXPECT_EQ(png->pixel_format, +image_t::PIXEL_FORMAT_PNG);
  EXPECT_EQ(png->width_px, 40);
  EXPECT_EQ(png->height_px, 30);
  EXPECT_FALSE(probe_image({}));
  EXPECT_FALSE(probe_image(grey));
}

// Bytes of zeros, compressed.
Bytes deflated_zeros(std::size_t bytes) {
  z_stream stream{};
  EXPECT_EQ(deflateInit(&stream, Z_BEST_COMPRESSION), Z_OK);
  const Bytes zeros(std::size_t{1} << 20, 0);
  Bytes out;
  std::array<std::uint8_t, 65536> piece{};
  for (std::size_t left = bytes; left > 0 || stream.avail_out == 0;) {
    const std::size_t now = std::min(left, zeros.size());
    left -= now;
    stream.next_in = const_cast<Bytef*>(zeros.data());
    stream.avail_in = static_cast<uInt>(now);
    do {
      stream.next_out = piece.data();
      stream.avail_out = static_cast<uInt>(piece.size());
      deflate(&stream, left == 0 ? Z_FINISH : Z_NO_FLUSH);
      out.insert(out.end(), piece.data(), stream.next_out);
    } while (stream.avail_out == 0);
  }
  deflateEnd(&stream);
  return out;
}

// Puts a chunk behind the header of a PNG file.
void put_chunk(const std::string& name, const Bytes& content, Bytes* png) {
  constexpr std::size_t kBehindHeader = 8 + 25;  // signature, IHDR
  const auto put_32 = [](std::uint32_t value, Bytes* out) {
    for (int shift = 24; shift >= 0; shift -= 8) out->push_back(static_cast<std::uint8_t>(value >> shift));
  };
  Bytes chunk;
  put_32(static_cast<std::uint32_t>(content.size()), &chunk);
  chunk.insert(chunk.end(), name.begin(), name.end());
  chunk.insert(chunk.end(), content.begin(), content.end());
  put_32(static_cast<std::uint32_t>(crc32(0, chunk.data() + 4, static_cast<uInt>(chunk.size() - 4))), &chunk);
  png->insert(png->begin() + kBehindHeader, chunk.begin(), chunk.end());
}

TEST(ImageCodec, TextOfAPngTakesNoMemory) {
  // 8 MB of zeros in each chunk, a few kB compressed.
  const Bytes zeros = deflated_zeros(std::size_t{8} << 20);
  Bytes text = {'x', 0, 0}, international = {'x', 0, 1, 0, 0, 0}, profile = {'x', 0, 0};
  for (Bytes* content : {&text, &international, &profile})
    content->insert(content->end(), zeros.begin(), zeros.end());
  const Bytes grey = picture(40, 30, 1);
  for (const auto& [name, content] :
       {std::pair{"zTXt", text}, std::pair{"iTXt", international}, std::pair{"iCCP", profile}}) {
    Bytes png = to_png(grey, 40, 30, PNG_COLOR_TYPE_GRAY, 8, PNG_INTERLACE_NONE);
    for (int i = 0; i < 20; ++i) put_chunk(name, content, &png);
    ImageDecoder decoder;
    GreyImage image;
    ASSERT_EQ(decoder.decode(message(image_t::PIXEL_FORMAT_PNG, 40, 30, png), &image), ImageStatus::kOk)
        << name;
    EXPECT_EQ(image.pixels, grey) << name;
    EXPECT_LE(decoder.working_bytes(), ImageDecoder::kMaxWorkingBytes) << name;
  }
}

TEST(ImageCodec, AJpegThatNeedsMoreMemoryThanItsSizeAllowsIsRefusedAndTheNextOneDecoded) {
  const Bytes grey = picture(4096, 16, 1);
  ImageDecoder decoder;
  GreyImage image;
  const Bytes jpeg = to_jpeg(grey, 4096, 16, 1, true);
  ASSERT_EQ(decoder.decode(message(image_t::PIXEL_FORMAT_MJPEG, 4096, 16, jpeg), &image), ImageStatus::kOk);
  // Sampling factors that blow its second component up: one 16th of the first's blocks would be needed.
  Bytes rgb;
  for (int i = 0; i < 4096 * 16; ++i) rgb.insert(rgb.end(), {10, 200, 30});
  Bytes colour = to_jpeg(rgb, 4096, 16, 3, true);
  EXPECT_EQ(decoder.decode(message(image_t::PIXEL_FORMAT_MJPEG, 4096, 16, colour), &image), ImageStatus::kOk);
  EXPECT_LE(decoder.working_bytes(), ImageDecoder::kMaxWorkingBytes);
}

TEST(ImageCodec, MorePixelsThanTheLimitAreRefused) {
  const Bytes grey = picture(40, 30, 1);
  for (const auto& [format, data] :
       {std::pair{image_t::PIXEL_FORMAT_GREY, grey},
        std::pair{image_t::PIXEL_FORMAT_MJPEG, to_jpeg(grey, 40, 30, 1)},
        std::pair{image_t::PIXEL_FORMAT_PNG,
                  to_png(grey, 40, 30, PNG_COLOR_TYPE_GRAY, 8, PNG_INTERLACE_NONE)}}) {
    GreyImage image;
    EXPECT_EQ(ImageDecoder(1200).decode(message(format, 40, 30, data), &image), ImageStatus::kOk);
    EXPECT_EQ(ImageDecoder(1199).decode(message(format, 40, 30, data), &image), ImageStatus::kTooLarge);
  }
}

TEST(DecodeArena, AllocatesUpToItsLimitAndStartsAnewAfterIt) {
  DecodeArena arena;
  arena.reset(std::size_t{3} << 20);
  EXPECT_NE(arena.allocate(1000), nullptr);
  EXPECT_NE(arena.allocate(std::size_t{2} << 20), nullptr);
  EXPECT_FALSE(arena.has_refused());
  EXPECT_EQ(arena.allocate(std::size_t{2} << 20), nullptr);
  EXPECT_TRUE(arena.has_refused());
  EXPECT_LE(arena.bytes(), std::size_t{3} << 20);
  arena.reset();
  EXPECT_FALSE(arena.has_refused());
  EXPECT_EQ(arena.bytes(), std::size_t{1} << 20) << "blocks of another image's sizes are not in the way";
  EXPECT_NE(arena.allocate(std::size_t{2} << 20), nullptr);
  EXPECT_EQ(arena.allocate(SIZE_MAX), nullptr);
}

class DamagedImage : public testing::TestWithParam<bool> {
 protected:
  [[nodiscard]] image_t intact() const {
    const Bytes grey = picture(64, 48, 1);
    return GetParam() ? message(image_t::PIXEL_FORMAT_MJPEG, 64, 48, to_jpeg(grey, 64, 48, 1))
                      : message(image_t::PIXEL_FORMAT_PNG, 64, 48,
                                to_png(grey, 64, 48, PNG_COLOR_TYPE_GRAY, 8, PNG_INTERLACE_NONE));
  }
};

TEST_P(DamagedImage, CutOffAnywhereIsRefused) {
  ImageDecoder decoder;
  GreyImage image;
  const image_t whole = intact();
  for (std::int32_t size = 0; size < whole.size; ++size) {
    image_t cut = whole;
    cut.size = size;
    EXPECT_NE(decoder.decode(cut, &image), ImageStatus::kOk) << size << " of " << whole.size;
    (void)probe_image(std::span(cut.data).first(static_cast<std::size_t>(size)));
  }
  EXPECT_EQ(decoder.decode(whole, &image), ImageStatus::kOk);  // and the decoder still works
}

TEST_P(DamagedImage, FlippedBitsAreSurvived) {
  ImageDecoder decoder;
  GreyImage image;
  const image_t whole = intact();
  int refused = 0;
  for (std::size_t bit = 0; bit < 8 * whole.data.size(); bit += 3) {
    image_t damaged = whole;
    damaged.data[bit / 8] = static_cast<std::uint8_t>(damaged.data[bit / 8] ^ (1U << (bit % 8)));
    const ImageStatus status = decoder.decode(damaged, &image);
    if (status == ImageStatus::kOk) {
      EXPECT_EQ(image.pixels.size(), 64U * 48U);
    }
    refused += status == ImageStatus::kOk ? 0 : 1;
    (void)probe_image(damaged.data);
  }
  EXPECT_GT(refused, 0);
  EXPECT_EQ(decoder.decode(whole, &image), ImageStatus::kOk);
}

TEST_P(DamagedImage, NoiseIsRefused) {
  ImageDecoder decoder;
  GreyImage image;
  std::mt19937_64 rng(11);
  for (int i = 0; i < 500; ++i) {
    image_t noise = intact();
    for (std::size_t at = static_cast<std::size_t>(rng() % 40); at < noise.data.size(); ++at) {
      noise.data[at] = static_cast<std::uint8_t>(rng());
    }
    EXPECT_NE(decoder.decode(noise, &image), ImageStatus::kOk);
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, DamagedImage, testing::Bool(),
                         [](const auto& info) { return std::string(info.param ? "Jpeg" : "Png"); });

}  // namespace
}  // namespace farpoint::ipc
