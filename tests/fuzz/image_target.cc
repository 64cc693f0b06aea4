// SPDX-License-Identifier: Apache-2.0
// Image files of every format.
#include <algorithm>

#include "ipc/image_codec.h"
#include "tests/fuzz/small_images.h"
#include "tests/fuzz/targets.h"
#include "tests/ipc/jpeg_images.h"
#include "tests/ipc/png_images.h"

namespace farpoint::fuzz {
namespace {

constexpr std::int64_t kMostPixels = std::int64_t{1} << 20;

// An input: number of the format, width and height (two bytes each) that the message claims, data. A claim
// of 0 stands for the file's own size.
constexpr std::size_t kHeadBytes = 5;
constexpr std::int32_t kFormats[] = {image_t::PIXEL_FORMAT_GREY, image_t::PIXEL_FORMAT_MJPEG,
                                     image_t::PIXEL_FORMAT_PNG};

image_t message_of(ByteView input) {
  image_t message{};
  message.pixel_format = kFormats[input[0] % std::size(kFormats)];
  message.width = input[1] << 8 | input[2];
  message.height = input[3] << 8 | input[4];
  message.data.assign(input.begin() + kHeadBytes, input.end());
  message.size = static_cast<std::int32_t>(message.data.size());
  const auto info = ipc::probe_image(message.data);
  if (info && message.width == 0 && message.height == 0) {
    message.width = info->width_px;
    message.height = info->height_px;
  }
  return message;
}

Bytes input_of(std::size_t format, const Bytes& file, int width_px = 0, int height_px = 0) {
  Bytes input(kHeadBytes + file.size());
  input[0] = static_cast<std::uint8_t>(format);
  input[2] = static_cast<std::uint8_t>(width_px);
  input[4] = static_cast<std::uint8_t>(height_px);
  std::copy(file.begin(), file.end(), input.begin() + kHeadBytes);
  return input;
}

Bytes grey_pixels() {
  Bytes pixels;
  for (int i = 0; i < kSmallWidth_px * kSmallHeight_px; ++i)
    pixels.push_back(static_cast<std::uint8_t>(5 * i));
  return pixels;
}

}  // namespace

void run_image(ByteView input) {
  if (input.size() < kHeadBytes) return;
  // Kept from input to input, as in a run.
  static ipc::ImageDecoder decoder(kMostPixels);
  static ipc::GreyImage image;
  const image_t message = message_of(input);
  const ipc::ImageStatus status = decoder.decode(message, &image);
  require(decoder.working_bytes() <= ipc::ImageDecoder::kMaxWorkingBytes,
          "working memory stays in its limit");
  require(image.pixels.size() <= static_cast<std::size_t>(kMostPixels), "no image is larger than the limit");
  if (status != ipc::ImageStatus::kOk) return;
  require(image.width_px == message.width && image.height_px == message.height, "the size is the message's");
  require(image.pixels.size() ==
              static_cast<std::size_t>(image.width_px) * static_cast<std::size_t>(image.height_px),
          "every pixel is there");
}

std::vector<image_t> small_images() {
  const Bytes grey = grey_pixels();
  std::vector<image_t> images(3);
  images[0].data = grey;
  images[1].data = test::to_jpeg(grey, kSmallWidth_px, kSmallHeight_px, 1);
  images[2].data = test::to_png(grey, kSmallWidth_px, kSmallHeight_px, test::PngKind::kGrey);
  for (std::size_t i = 0; i < images.size(); ++i) {
    images[i].width = kSmallWidth_px;
    images[i].height = kSmallHeight_px;
    images[i].pixel_format = kFormats[i];
    images[i].size = static_cast<std::int32_t>(images[i].data.size());
  }
  return images;
}

std::vector<Bytes> seeds_of_image() {
  const Bytes grey = grey_pixels();
  Bytes rgb;
  for (const std::uint8_t value : grey)
    rgb.insert(rgb.end(), {value, static_cast<std::uint8_t>(255 - value), 7});
  std::vector<Bytes> seeds;
  seeds.push_back(input_of(0, grey, kSmallWidth_px, kSmallHeight_px));
  for (const bool progressive : {false, true}) {
    seeds.push_back(input_of(1, test::to_jpeg(grey, kSmallWidth_px, kSmallHeight_px, 1, progressive)));
    seeds.push_back(input_of(1, test::to_jpeg(rgb, kSmallWidth_px, kSmallHeight_px, 3, progressive)));
  }
  for (const test::PngKind kind : {test::PngKind::kGrey, test::PngKind::kGreyInterlaced})
    seeds.push_back(input_of(2, test::to_png(grey, kSmallWidth_px, kSmallHeight_px, kind)));
  seeds.push_back(input_of(2, test::to_png(rgb, kSmallWidth_px, kSmallHeight_px, test::PngKind::kRgb)));
  Bytes with_text = test::to_png(grey, kSmallWidth_px, kSmallHeight_px, test::PngKind::kGrey);
  for (const char* chunk : {"zTXt", "iTXt", "iCCP", "tEXt"})
    test::put_png_chunk(chunk, {'x', 0, 0, 'y'}, &with_text);
  seeds.push_back(input_of(2, with_text));
  return seeds;
}

}  // namespace farpoint::fuzz
