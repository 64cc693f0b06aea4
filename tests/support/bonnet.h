// SPDX-License-Identifier: Apache-2.0
// A bonnet in the lower part of a recording's images: a gradient, waves and highlights that keep their place
// in every image, with or without noise of its own.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "ipc/image_codec.h"
#include "ipc/image_encoder.h"
#include "ipc/log.h"
#include "ipc/message.h"

namespace farpoint::test {

struct BonnetOptions {
  double share = 0.23;  // of the image's rows
  double noise = 0;     // grey levels, 1 sigma, another in every image
  std::uint64_t seed = 1;
};

class Bonnet {
 public:
  Bonnet(int width_px, int height_px, const BonnetOptions& options)
      : options_(options),
        width_px_(width_px),
        first_row_(static_cast<int>(std::lround((1.0 - options.share) * height_px))),
        random_(options.seed) {
    const int rows = height_px - first_row_;
    shades_.resize(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(rows));
    for (int y = 0; y < rows; ++y)
      for (int x = 0; x < width_px; ++x) at(x, y) = 60.0 + 70.0 * y / rows;
    add_waves(rows);
    add_highlights(rows);
  }

  // First row of the bonnet.
  [[nodiscard]] int first_row() const { return first_row_; }

  // Paints it over the pixels, row by row. Other pixels stay.
  void paint(std::vector<std::uint8_t>* pixels) {
    std::uint8_t* to =
        pixels->data() + static_cast<std::size_t>(first_row_) * static_cast<std::size_t>(width_px_);
    for (const double shade : shades_) {
      const double noise = options_.noise > 0 ? options_.noise * normal() : 0;
      *to++ = static_cast<std::uint8_t>(std::clamp(std::lround(shade + noise), 0L, 255L));
    }
  }

  // A mask of just these rows, of an image of this size.
  [[nodiscard]] std::vector<std::uint8_t> mask() const {
    std::vector<std::uint8_t> pixels(
        static_cast<std::size_t>(first_row_) * static_cast<std::size_t>(width_px_), 255);
    pixels.resize(pixels.size() + shades_.size(), 0);
    return pixels;
  }

 private:
  static constexpr double kTurn = 6.283185307179586;

  [[nodiscard]] double& at(int x, int y) {
    return shades_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px_) +
                   static_cast<std::size_t>(x)];
  }
  // Uniform in [0, 1) and standard normal, the same on every standard library.
  double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  double normal() { return std::sqrt(-2 * std::log(1 - uniform())) * std::cos(kTurn * uniform()); }

  // What the paint reflects: wavelengths of 8 to 64 px, 12 grey levels.
  void add_waves(int rows) {
    constexpr int kWaves = 40;
    for (int i = 0; i < kWaves; ++i) {
      const double length = 8.0 * std::pow(8.0, uniform()), direction = kTurn * uniform(),
                   phase = kTurn * uniform(), k = kTurn / length;
      for (int y = 0; y < rows; ++y)
        for (int x = 0; x < width_px_; ++x)
          at(x, y) += 12.0 * std::sqrt(2.0 / kWaves) *
                      std::sin(k * (std::cos(direction) * x + std::sin(direction) * y) + phase);
    }
  }
  // Small bright spots with corners enough for a tracker.
  void add_highlights(int rows) {
    constexpr double kPixelsASpot = 2500, kBrightness = 80;
    const int spots = static_cast<int>(width_px_ * rows / kPixelsASpot);
    for (int i = 0; i < spots; ++i) {
      const double cx = uniform() * width_px_, cy = uniform() * rows, radius = 2 + 5 * uniform();
      const int reach = static_cast<int>(4 * radius);
      for (int y = std::max(0, static_cast<int>(cy) - reach);
           y < std::min(rows, static_cast<int>(cy) + reach); ++y)
        for (int x = std::max(0, static_cast<int>(cx) - reach);
             x < std::min(width_px_, static_cast<int>(cx) + reach); ++x)
          at(x, y) +=
              kBrightness * std::exp(-((x - cx) * (x - cx) + (y - cy) * (y - cy)) / (2 * radius * radius));
    }
  }

  BonnetOptions options_;
  int width_px_, first_row_;
  std::mt19937_64 random_;
  std::vector<double> shades_;  // of the bonnet's rows
};

// Copies a recording and paints the bonnet over the images of CAMERA_0, which become PNG. Returns the first
// row of the bonnet. Throws std::runtime_error where an image cannot be decoded.
inline int paint_bonnet(const std::string& from, const std::string& to, const BonnetOptions& options) {
  ipc::LogReader reader(from);
  ipc::LogWriter writer(to);
  ipc::ImageDecoder decoder;
  std::unique_ptr<Bonnet> bonnet;
  ipc::LogEvent event;
  image_t message{};
  ipc::GreyImage image;
  while (reader.next(&event)) {
    if (event.channel != "CAMERA_0") {
      writer.write(event.channel, event.timestamp_us, event.data);
      continue;
    }
    if (!ipc::decode(event.data, &message) || decoder.decode(message, &image) != ipc::ImageStatus::kOk)
      throw std::runtime_error(from + ": an image cannot be decoded");
    if (!bonnet) bonnet = std::make_unique<Bonnet>(image.width_px, image.height_px, options);
    bonnet->paint(&image.pixels);
    message.data = ipc::encode_png({image.width_px, image.height_px, image.pixels});
    message.size = static_cast<std::int32_t>(message.data.size());
    message.pixel_format = image_t::PIXEL_FORMAT_PNG;
    writer.write_message(event.channel, event.timestamp_us, message);
  }
  writer.close();
  return bonnet ? bonnet->first_row() : 0;
}

}  // namespace farpoint::test
