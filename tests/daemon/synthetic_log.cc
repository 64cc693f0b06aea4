// SPDX-License-Identifier: Apache-2.0
#include "tests/daemon/synthetic_log.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <random>

#include "ipc/image_codec.h"
#include "ipc/log.h"

namespace farpoint::test {
namespace {

constexpr int kWidth_px = 480, kHeight_px = 320;
constexpr double kFocal_px = 400.0;
constexpr int kCells = 5;  // of a square's texture, a side
constexpr std::int64_t kStart_us = 1'000'000;

struct Square {
  double x_m, y_m, z_m, half_m;
  std::array<std::uint8_t, kCells * kCells> grey;
};

// Far ones first, so that near ones are painted over them.
const std::vector<Square>& world() {
  static const std::vector<Square> squares = [] {
    std::mt19937_64 random(42);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    std::vector<Square> all(900);
    for (Square& s : all) {
      s.z_m = 6.0 * std::pow(10.0, unit(random));  // 6 to 60 m
      s.x_m = (3.0 * unit(random) - 1.2) * s.z_m;
      s.y_m = (unit(random) - 0.5) * s.z_m;
      s.half_m = s.z_m * (0.012 + 0.02 * unit(random));
      for (std::uint8_t& g : s.grey) g = static_cast<std::uint8_t>(20 + random() % 216);
    }
    std::sort(all.begin(), all.end(), [](const Square& a, const Square& b) { return a.z_m > b.z_m; });
    return all;
  }();
  return squares;
}

// Paints one square, four samples a pixel each way, so that its edges move by fractions of a pixel.
void paint(const Square& s, double x_m, double z_m, std::vector<float>* image) {
  constexpr int kSamples = 2;
  const double depth_m = s.z_m - z_m;
  if (depth_m < 1.0) return;
  const double u = kFocal_px * (s.x_m - x_m) / depth_m + 0.5 * kWidth_px;
  const double v = kFocal_px * s.y_m / depth_m + 0.5 * kHeight_px;
  const double half_px = kFocal_px * s.half_m / depth_m;
  const int left = std::max(0, static_cast<int>(std::floor(u - half_px))),
            right = std::min(kWidth_px - 1, static_cast<int>(std::ceil(u + half_px)));
  const int top = std::max(0, static_cast<int>(std::floor(v - half_px))),
            bottom = std::min(kHeight_px - 1, static_cast<int>(std::ceil(v + half_px)));
  for (int y = top; y <= bottom; ++y) {
    for (int x = left; x <= right; ++x) {
      float sum = 0.0f;
      int inside = 0;
      for (int i = 0; i < kSamples * kSamples; ++i) {
        const double px = x - 0.5 + (i % kSamples + 0.5) / kSamples,
                     py = y - 0.5 + (i / kSamples + 0.5) / kSamples;
        const double a = (px - u + half_px) / (2.0 * half_px), b = (py - v + half_px) / (2.0 * half_px);
        if (a < 0.0 || a >= 1.0 || b < 0.0 || b >= 1.0) continue;
        sum += static_cast<float>(s.grey[static_cast<std::size_t>(static_cast<int>(b * kCells) * kCells +
                                                                  static_cast<int>(a * kCells))]);
        ++inside;
      }
      float& pixel = (*image)[static_cast<std::size_t>(y * kWidth_px + x)];
      pixel = (sum + pixel * static_cast<float>(kSamples * kSamples - inside)) /
              static_cast<float>(kSamples * kSamples);
    }
  }
}

camera_calibration_t pinhole(const std::string& name, int width, int height, double fx, double fy, double cx,
                             double cy) {
  camera_calibration_t c{};
  c.name = name;
  c.model = "pinhole-radtan";
  c.width = width;
  c.height = height;
  c.fx = fx;
  c.fy = fy;
  c.cx = cx;
  c.cy = cy;
  // Camera axes in a body of x forward, y left, z up.
  c.orientation[0] = 0.5;
  c.orientation[1] = -0.5;
  c.orientation[2] = 0.5;
  c.orientation[3] = -0.5;
  c.rate_hz = 10.0;
  return c;
}

calibration_t one_camera(const camera_calibration_t& camera) {
  calibration_t c{};
  c.ncameras = 1;
  c.cameras = {camera};
  c.imu_orientation[0] = 1.0;
  return c;
}

std::vector<std::uint8_t> file_bytes(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

calibration_t synthetic_calibration() {
  return one_camera(
      pinhole("front", kWidth_px, kHeight_px, kFocal_px, kFocal_px, 0.5 * kWidth_px, 0.5 * kHeight_px));
}

image_t synthetic_image(const SyntheticLog& log, int number) {
  std::vector<float> pixels(static_cast<std::size_t>(kWidth_px * kHeight_px), 90.0f);
  const double way_m = log.step_m * number;
  for (const Square& s : world()) paint(s, 0.8 * way_m, 0.6 * way_m, &pixels);
  image_t image{};
  image.utime = kStart_us + number * log.period_us;
  image.sequence = number;
  image.camera = log.camera;
  image.exposure_us = -1;
  image.gain = -1.0f;
  image.width = kWidth_px;
  image.height = kHeight_px;
  image.row_stride = kWidth_px;
  image.pixel_format = image_t::PIXEL_FORMAT_GREY;
  image.size = kWidth_px * kHeight_px;
  image.data.resize(pixels.size());
  std::transform(pixels.begin(), pixels.end(), image.data.begin(),
                 [](float p) { return static_cast<std::uint8_t>(std::lround(p)); });
  return image;
}

void write_synthetic_log(const std::string& path, const SyntheticLog& log) {
  ipc::LogWriter writer(path);
  constexpr std::int64_t kReceivedLater_us = 777'000'000;
  if (log.with_calibration) writer.write_message("CALIBRATION", kReceivedLater_us, synthetic_calibration());
  for (int i = 0; i < log.frames; ++i) {
    const image_t image = synthetic_image(log, i);
    writer.write_message("CAMERA_" + std::to_string(log.camera), kReceivedLater_us + image.utime, image);
  }
  writer.close();
}

bool write_kitti_log(const std::string& sequence_folder, int frames, const std::string& path) {
  namespace fs = std::filesystem;
  std::ifstream calib(sequence_folder + "/calib.txt"), times(sequence_folder + "/times.txt");
  std::string label;
  std::array<double, 12> P{};
  calib >> label;
  for (double& p : P) calib >> p;
  if (!calib || !times) return false;
  ipc::LogWriter writer(path);
  for (int i = 0; i < frames; ++i) {
    char name[32];
    std::snprintf(name, sizeof(name), "/image_0/%06d", i);
    std::string file = sequence_folder + name + ".jpg";
    if (!fs::exists(file)) file = sequence_folder + name + ".png";
    const std::vector<std::uint8_t> bytes = file_bytes(file);
    const auto info = ipc::probe_image(bytes);
    double seconds = 0.0;
    if (!info || !(times >> seconds)) return false;
    if (i == 0) {
      const auto camera = pinhole("image_0", info->width_px, info->height_px, P[0], P[5], P[2], P[6]);
      writer.write_message("CALIBRATION", 0, one_camera(camera));
    }
    image_t image{};
    image.utime = std::llround(1e6 * seconds);
    image.sequence = i;
    image.exposure_us = -1;
    image.width = info->width_px;
    image.height = info->height_px;
    image.pixel_format = info->pixel_format;
    image.size = static_cast<std::int32_t>(bytes.size());
    image.data = bytes;
    writer.write_message("CAMERA_0", image.utime, image);
  }
  writer.close();
  return true;
}

}  // namespace farpoint::test
