// SPDX-License-Identifier: Apache-2.0
#include "ipc/image_codec.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>
#include <string>

#include "tests/ipc/jpeg_images.h"
#include "tests/ipc/png_images.h"

namespace farpoint::ipc {
namespace {

using test::deflated_zeros;
using test::PngKind;
using test::put_png_chunk;
using test::to_jpeg;
using test::to_png;
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
  for (const auto& [pixels, kind] : {std::pair{grey, PngKind::kGrey},
                                     {grey, PngKind::kGreyInterlaced},
                                     {rgb, PngKind::kRgb},
                                     {rgb, PngKind::kRgbInterlaced},
                                     {rgba, PngKind::kRgba},
                                     {rgba, PngKind::kRgbaInterlaced},
                                     {grey16, PngKind::kGrey16},
                                     {grey16, PngKind::kGrey16Interlaced}}) {
    const image_t in =
        message(image_t::PIXEL_FORMAT_PNG, width_px, height_px, to_png(pixels, width_px, height_px, kind));
    ASSERT_EQ(decoder.decode(in, &image), ImageStatus::kOk) << static_cast<int>(kind);
    EXPECT_LE(largest_difference(image.pixels, grey), 1) << static_cast<int>(kind);
  }
}

TEST(ImageCodec, AnotherSizeThanTheMessageSaysIsRefused) {
  ImageDecoder decoder;
  GreyImage image;
  const Bytes grey = picture(40, 30, 1);
  EXPECT_EQ(decoder.decode(message(image_t::PIXEL_FORMAT_MJPEG, 41, 30, to_jpeg(grey, 40, 30, 1)), &image),
            ImageStatus::kWrongSize);
  EXPECT_EQ(decoder.decode(message(image_t::PIXEL_FORMAT_PNG, 40, 31, to_png(grey, 40, 30, PngKind::kGrey)),
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
  const auto png = probe_image(to_png(grey, 40, 30, PngKind::kGrey));
  ASSERT_TRUE(png);
  EXPECT_EQ(png->pixel_format, +image_t::PIXEL_FORMAT_PNG);
  EXPECT_EQ(png->width_px, 40);
  EXPECT_EQ(png->height_px, 30);
  EXPECT_FALSE(probe_image({}));
  EXPECT_FALSE(probe_image(grey));
}

// Zeros of 0.9 or 8 MB in each chunk, a few kB compressed.
TEST(ImageCodec, TextOfAPngTakesNoMemory) {
  const Bytes grey = picture(40, 30, 1);
  for (const std::size_t inflated : {std::size_t{900} << 10, std::size_t{8} << 20}) {
    const Bytes zeros = deflated_zeros(inflated);
    Bytes text = {'x', 0, 0}, international = {'x', 0, 1, 0, 0, 0};
    for (Bytes* content : {&text, &international})
      content->insert(content->end(), zeros.begin(), zeros.end());
    const std::pair<std::string, Bytes> chunks[] = {{"zTXt", text}, {"iTXt", international}, {"iCCP", text}};
    for (const auto& [name, content] : chunks) {
      Bytes png = to_png(grey, 40, 30, PngKind::kGrey);
      for (int i = 0; i < 20; ++i) put_png_chunk(name, content, &png);
      ImageDecoder decoder;
      GreyImage image;
      ASSERT_EQ(decoder.decode(message(image_t::PIXEL_FORMAT_PNG, 40, 30, png), &image), ImageStatus::kOk)
          << name;
      EXPECT_EQ(image.pixels, grey) << name;
      EXPECT_LE(decoder.working_bytes(), ImageDecoder::kMaxWorkingBytes) << name;
    }
  }
}

TEST(ImageCodec, AProgressiveJpegOfAnyShapeIsDecodedWithinTheLimit) {
  for (const auto& [width_px, height_px] : {std::pair{4096, 16}, {16, 4096}, {16384, 1}, {1, 16384}}) {
    Bytes rgb(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) * 3, 77);
    const Bytes jpeg = to_jpeg(rgb, width_px, height_px, 3, true);
    ImageDecoder decoder;
    GreyImage image;
    EXPECT_EQ(decoder.decode(message(image_t::PIXEL_FORMAT_MJPEG, width_px, height_px, jpeg), &image),
              ImageStatus::kOk);
    EXPECT_LE(decoder.working_bytes(), ImageDecoder::kMaxWorkingBytes);
  }
}

TEST(ImageCodec, MorePixelsThanTheLimitAreRefused) {
  const Bytes grey = picture(40, 30, 1);
  const std::pair<std::int32_t, Bytes> images[] = {
      {image_t::PIXEL_FORMAT_GREY, grey},
      {image_t::PIXEL_FORMAT_MJPEG, to_jpeg(grey, 40, 30, 1)},
      {image_t::PIXEL_FORMAT_PNG, to_png(grey, 40, 30, PngKind::kGrey)}};
  for (const auto& [format, data] : images) {
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
                      : message(image_t::PIXEL_FORMAT_PNG, 64, 48, to_png(grey, 64, 48, PngKind::kGrey));
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
