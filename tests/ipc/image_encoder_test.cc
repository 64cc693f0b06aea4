// SPDX-License-Identifier: Apache-2.0
#include "ipc/image_encoder.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <stdexcept>

#include "ipc/image_codec.h"

namespace farpoint::ipc {
namespace {

// A smooth picture with a size that no block of JPEG divides.
std::vector<std::uint8_t> picture(int width_px, int height_px) {
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < height_px; ++y)
    for (int x = 0; x < width_px; ++x)
      pixels.push_back(static_cast<std::uint8_t>((2 * x + 3 * y) % 200 + 20));
  return pixels;
}

GreyImage decoded(std::int32_t format, int width_px, int height_px, std::vector<std::uint8_t> bytes) {
  image_t message{};
  message.pixel_format = format;
  message.width = width_px;
  message.height = height_px;
  message.size = static_cast<std::int32_t>(bytes.size());
  message.data = std::move(bytes);
  GreyImage image;
  EXPECT_EQ(ImageDecoder().decode(message, &image), ImageStatus::kOk);
  return image;
}

TEST(ImageEncoder, PngKeepsEveryPixel) {
  const std::vector<std::uint8_t> pixels = picture(37, 21);
  const auto bytes = encode_png({37, 21, pixels});
  const auto info = probe_image(bytes);
  ASSERT_TRUE(info);
  EXPECT_EQ(info->width_px, 37);
  EXPECT_EQ(info->height_px, 21);
  EXPECT_EQ(decoded(image_t::PIXEL_FORMAT_PNG, 37, 21, bytes).pixels, pixels);
}

TEST(ImageEncoder, JpegIsCloseAndSmallerWithLessQuality) {
  const std::vector<std::uint8_t> pixels = picture(123, 77);
  const auto good = encode_jpeg({123, 77, pixels}, 95), poor = encode_jpeg({123, 77, pixels}, 20);
  EXPECT_LT(poor.size(), good.size());
  const GreyImage image = decoded(image_t::PIXEL_FORMAT_MJPEG, 123, 77, good);
  ASSERT_EQ(image.pixels.size(), pixels.size());
  double difference = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) difference += std::abs(image.pixels[i] - pixels[i]);
  EXPECT_LT(difference / static_cast<double>(pixels.size()), 2.0);
}

TEST(ImageEncoder, RefusesWhatHasNoPixels) {
  const std::vector<std::uint8_t> pixels = picture(4, 4);
  EXPECT_THROW((void)encode_png({0, 4, pixels}), std::runtime_error);
  EXPECT_THROW((void)encode_jpeg({4, -1, pixels}, 90), std::runtime_error);
  EXPECT_THROW((void)encode_png({5, 4, pixels}), std::runtime_error);
  EXPECT_THROW((void)encode_jpeg({100000, 1, picture(100000, 1)}, 90), std::runtime_error);  // beyond JPEG
}

}  // namespace
}  // namespace farpoint::ipc
