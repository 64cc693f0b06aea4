// SPDX-License-Identifier: Apache-2.0
#include "daemon/config/mask_file.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <optional>
#include <system_error>
#include <vector>

#include "daemon/config/rig.h"
#include "ipc/file_kind.h"
#include "ipc/image_codec.h"
#include "ipc/printable.h"

namespace farpoint::daemon {
namespace {

constexpr const char* kNone = "none";
constexpr const char* kWanted = "a PNG file of 8-bit grey";
// A PNG file of a mask is far smaller; a larger file is not read.
constexpr std::size_t kMaxFileBytes = std::size_t{64} << 20;

// Key and file in front of every complaint.
struct Place {
  std::string key, file;

  [[noreturn]] void fail(const std::string& what) const {
    throw ConfigError(ipc::printable("configuration: " + key + ": " + file + ": " + what));
  }
};

std::vector<std::uint8_t> read_bytes(const Place& place) {
  std::ifstream in(place.file, std::ios::binary);
  if (!in)
    place.fail("cannot be opened (" + std::generic_category().message(errno) + "), expected " + kWanted);
  std::vector<std::uint8_t> bytes;
  std::array<char, 65536> block{};
  while (in.read(block.data(), block.size()) || in.gcount() > 0) {
    bytes.insert(bytes.end(), block.begin(), block.begin() + in.gcount());
    if (bytes.size() > kMaxFileBytes) place.fail(fmt::format("over 64 MiB, expected {}", kWanted));
  }
  if (in.bad()) place.fail(std::string("cannot be read, expected ") + kWanted);
  return bytes;
}

// Bit depth and colour type of a PNG file, in words; empty for 8-bit grey. A PNG file begins with 8 bytes of
// signature, then the chunk IHDR: length, name, width, height, depth, colour type (PNG, section 11.2.2).
std::string other_pixels(std::span<const std::uint8_t> png) {
  constexpr std::size_t kDepth = 24, kColour = 25;
  constexpr int kGrey = 0;
  if (png[kDepth] == 8 && png[kColour] == kGrey) return {};
  static constexpr std::array<const char*, 7> kNames{"grey",           "", "RGB", "palette",
                                                     "grey and alpha", "", "RGBA"};
  const char* colour = png[kColour] < kNames.size() ? kNames[png[kColour]] : "unknown colour";
  return fmt::format("{}-bit {}", png[kDepth], colour);
}

ipc::GreyImage decode(const Place& place, std::vector<std::uint8_t> bytes, int width_px, int height_px) {
  const std::optional<ipc::ImageInfo> info = ipc::probe_image(bytes);
  if (!info || info->pixel_format != image_t::PIXEL_FORMAT_PNG)
    place.fail(std::string(info ? "a JPEG file" : "no image") + ", expected " + kWanted);
  if (info->width_px != width_px || info->height_px != height_px)
    place.fail(fmt::format("{} x {} pixels, expected the camera's {} x {}", info->width_px, info->height_px,
                           width_px, height_px));
  if (const std::string other = other_pixels(bytes); !other.empty())
    place.fail(other + ", expected " + kWanted);
  image_t message{};
  message.width = width_px;
  message.height = height_px;
  message.pixel_format = image_t::PIXEL_FORMAT_PNG;
  message.size = static_cast<std::int32_t>(bytes.size());
  message.data = std::move(bytes);
  ipc::GreyImage image;
  const ipc::ImageStatus status = ipc::ImageDecoder().decode(message, &image);
  if (status != ipc::ImageStatus::kOk) place.fail(std::string(to_string(status)) + ", expected " + kWanted);
  return image;
}

}  // namespace

std::shared_ptr<const slam::ImageMask> read_mask(const CameraConfig& config, int camera, int width_px,
                                                 int height_px) {
  if (camera > 1) return nullptr;
  const Place place{camera == 0 ? "camera.mask" : "camera.second_mask",
                    camera == 0 ? config.mask : config.second_mask};
  if (place.file == kNone) return nullptr;
  const ipc::GreyImage image = decode(place, read_bytes(place), width_px, height_px);
  auto mask = std::make_shared<const slam::ImageMask>(width_px, height_px, image.pixels);
  if (mask->share() > slam::ImageMask::kMostShare)
    place.fail(fmt::format("masks {:.1f} % of the image, expected at most {:.0f} %", 100.0 * mask->share(),
                           100.0 * slam::ImageMask::kMostShare));
  return mask;
}

void read_masks(const CameraConfig& config, const calibration_t& calibration, slam::Rig* rig) {
  const std::optional<int> second = second_camera(calibration, config);
  for (std::size_t c = 0; c < calibration.cameras.size(); ++c) {
    const camera_calibration_t& camera = calibration.cameras[c];
    const auto mask = read_mask(config, static_cast<int>(c), camera.width, camera.height);
    if (mask == nullptr) continue;
    spdlog::info("camera {}: mask {}: {:.1f} % of the image", c, c == 0 ? config.mask : config.second_mask,
                 100.0 * mask->share());
    if (static_cast<int>(c) == config.index) rig->cameras.front().mask = mask;
    if (second == static_cast<int>(c) && rig->cameras.size() > 1) rig->cameras.back().mask = mask;
  }
}

}  // namespace farpoint::daemon
