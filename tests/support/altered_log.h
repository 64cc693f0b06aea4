// SPDX-License-Identifier: Apache-2.0
// Copies of a recording with other images: cut, painted over, warped.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "ipc/image_codec.h"
#include "ipc/log.h"
#include "ipc/message.h"

namespace farpoint::test {

struct Alteration {
  int first = 0, images = 1'000'000;  // of CAMERA_0: cut out of the recording
  // Of each, in order: the number within the cut, and pixels and size to change.
  std::function<void(int, ipc::GreyImage*)> image = [](int, ipc::GreyImage*) {};
  std::function<void(calibration_t*)> calibration = [](calibration_t*) {};
};

// Appends the cut to `writer`, its images as grey ones and no other camera's. Times move by `shift_us`.
// Returns the time of the last image. Throws std::runtime_error where an image cannot be decoded.
inline std::int64_t append_altered(const std::string& from, ipc::LogWriter* writer, const Alteration& change,
                                   std::int64_t shift_us = 0) {
  ipc::LogReader reader(from);
  ipc::ImageDecoder decoder;
  ipc::LogEvent event;
  calibration_t calibration{};
  image_t message{};
  ipc::GreyImage image;
  std::int64_t last_utime = 0;
  for (int number = -change.first; number < change.images && reader.next(&event);) {
    if (event.channel == "CALIBRATION" && ipc::decode(event.data, &calibration)) {
      calibration.cameras.resize(1);
      calibration.ncameras = 1;
      change.calibration(&calibration);
      writer->write_message("CALIBRATION", event.timestamp_us + shift_us, calibration);
    }
    if (event.channel != "CAMERA_0" || number++ < 0) continue;
    if (!ipc::decode(event.data, &message) || decoder.decode(message, &image) != ipc::ImageStatus::kOk)
      throw std::runtime_error(from + ": an image cannot be decoded");
    change.image(number - 1, &image);
    message.utime += shift_us;
    message.width = image.width_px;
    message.height = image.height_px;
    message.row_stride = image.width_px;
    message.pixel_format = image_t::PIXEL_FORMAT_GREY;
    message.data = image.pixels;
    message.size = static_cast<std::int32_t>(message.data.size());
    writer->write_message("CAMERA_0", event.timestamp_us + shift_us, message);
    last_utime = message.utime;
  }
  return last_utime;
}

// A log of the cut alone. Returns the time of its last image.
inline std::int64_t alter_log(const std::string& from, const std::string& to, const Alteration& change) {
  ipc::LogWriter writer(to);
  const std::int64_t last_utime = append_altered(from, &writer, change);
  writer.close();
  return last_utime;
}

// Noise of a camera, the same on every standard library: nearly normal, `sigma` grey levels.
class GreyNoise {
 public:
  explicit GreyNoise(double sigma, std::uint64_t seed = 1) : sigma_(sigma), random_(seed) {}
  void add(ipc::GreyImage* image) {
    for (std::uint8_t& pixel : image->pixels) pixel = noisy(pixel);
  }
  [[nodiscard]] std::uint8_t noisy(double level) {
    // The sum of four bytes has a sigma of 147.8.
    const std::uint64_t bits = random_();
    const auto sum =
        static_cast<double>((bits & 255) + (bits >> 8 & 255) + (bits >> 16 & 255) + (bits >> 24 & 255));
    const double value = level + sigma_ * (sum - 510.0) / 147.8;
    return static_cast<std::uint8_t>(std::lround(value < 0.0 ? 0.0 : value > 255.0 ? 255.0 : value));
  }

 private:
  double sigma_;
  std::mt19937_64 random_;
};

}  // namespace farpoint::test
