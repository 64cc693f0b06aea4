// SPDX-License-Identifier: Apache-2.0
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <stdexcept>

#include "daemon/check/checks.h"
#include "daemon/config/errors.h"
#include "daemon/config/rig.h"
#include "daemon/input/camera_driver.h"
#include "drivers/log/log_source.h"

namespace farpoint::daemon {
namespace {

constexpr double kMicro = 1e-6;

// The tracked camera's images of a log.
struct Images {
  std::int64_t count = 0, others = 0, first_utime = 0, last_utime = 0;
  ipc::ImageStatus first = ipc::ImageStatus::kOk;  // of decoding the first one

  [[nodiscard]] double seconds() const { return kMicro * static_cast<double>(last_utime - first_utime); }
};

Images read_images(drivers::LogSource* source, int camera) {
  Images images;
  ipc::GreyImage decoded;
  for (drivers::LogItem item; source->next(&item);) {
    if (item.kind != drivers::LogItemKind::kImage) continue;
    if (item.camera != camera) {
      ++images.others;
      continue;
    }
    if (images.count++ == 0) {
      images.first_utime = item.utime;
      images.first = source->decode(item, &decoded);
    }
    images.last_utime = item.utime;
  }
  return images;
}

// Images that a replay would not use.
std::uint64_t refused(const drivers::LogSourceCounts& counts) {
  return counts.messages_undecodable + counts.images_unknown_camera + counts.images_wrong_size +
         counts.images_undecodable + counts.times_backwards;
}

std::string described(const Images& images, const drivers::LogSourceCounts& counts) {
  std::string text = fmt::format("{} images in {:.1f} s", images.count, images.seconds());
  if (images.count > 1 && images.seconds() > 0.0)
    text += fmt::format(" ({:.4g} Hz)", static_cast<double>(images.count - 1) / images.seconds());
  if (images.others > 0) text += fmt::format(", {} of other cameras", images.others);
  if (counts.imu > 0) text += fmt::format(", {} of the IMU", counts.imu);
  if (counts.wheels > 0) text += fmt::format(", {} of the wheels", counts.wheels);
  if (counts.ground_truths > 0) text += fmt::format(", {} of the truth", counts.ground_truths);
  return text;
}

void check_images(const std::string& path, const Config& config, Findings* findings) {
  const std::string what = "log";
  const int camera = config.camera.index;
  drivers::LogSource source(path, most_image_pixels(config));
  const Images images = read_images(&source, camera);
  const ipc::LogDamage& damage = source.damage();
  if (images.count == 0)
    return findings->fail(what, fmt::format("{}: no image on CAMERA_{} that can be used", path, camera));
  if (images.first != ipc::ImageStatus::kOk)
    return findings->fail(what, fmt::format("{}: its first image: {}", path, to_string(images.first)));
  const std::string text = path + ": " + described(images, source.counts());
  if (damage.places > 0 || damage.cut_off)
    return findings->warn(what, fmt::format("{}; damaged in {} places{}", text, damage.places,
                                            damage.cut_off ? ", cut off within its last event" : ""));
  if (const std::uint64_t left_out = refused(source.counts()); left_out > 0)
    return findings->warn(what, fmt::format("{}; {} messages are not used", text, left_out));
  findings->ok(what, text);
}

}  // namespace

std::optional<calibration_t> check_log(const std::string& path, const Config& config, Findings* findings) {
  std::optional<calibration_t> calibration;
  try {
    calibration = calibration_of_log(path);
    check_image_size(*calibration, config);
    (void)make_rig(*calibration, config.camera);
    findings->ok("calibration", path + ": " + described(*calibration));
  } catch (const std::runtime_error& error) {
    findings->fail("calibration", error.what());
    return {};
  }
  try {
    check_images(path, config, findings);
  } catch (const std::runtime_error& error) {
    findings->fail("log", error.what());
  }
  return calibration;
}

}  // namespace farpoint::daemon
