// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/live_camera_options.h"

#include "daemon/config/camera_file.h"
#include "daemon/config/rig.h"
#include "daemon/input/camera_driver.h"

namespace farpoint::daemon {
namespace {

calibration_t calibration_of_cameras(const CameraConfig& camera, std::vector<std::string>* notices) {
  if (camera.calibration == "log") {
    if (camera.driver == CameraDriverChoice::kFile) return calibration_of_log(camera.device);
    throw ConfigError(
        "configuration: camera.calibration: log, expected a camera file, or camera.driver file");
  }
  if (camera.has_second())
    return read_stereo_calibration(camera.calibration, camera.second_calibration, notices);
  const CameraFile file = read_camera_file(camera.calibration);
  for (const std::string& notice : file.notices) notices->push_back(camera.calibration + ": " + notice);
  return calibration_of(file, "camera");
}

}  // namespace

calibration_t read_live_calibration(const Config& config, std::vector<std::string>* notices) {
  if (config.camera.index != 0)
    throw ConfigError("configuration: camera.index: " + std::to_string(config.camera.index) +
                      ", expected 0 for a live camera");
  calibration_t calibration = calibration_of_cameras(config.camera, notices);
  check_image_size(calibration, config);
  return calibration;
}

const std::string& device_of(const CameraConfig& camera, int index) {
  return index == 0 ? camera.device : camera.second_device;
}

drivers::ExposureOptions exposure_options(const ExposureConfig& config) {
  drivers::ExposureOptions o;
  o.mode = static_cast<drivers::ExposureMode>(config.mode);
  o.manual_us = config.manual_us;
  o.manual_gain = config.manual_gain;
  o.short_us = config.short_us;
  o.max_us = config.max_us;
  o.max_gain_share = config.max_gain_share;
  o.target_grey = config.target_grey;
  return o;
}

drivers::CameraOptions camera_options(const Config& config, const calibration_t& calibration, int index) {
  const CameraConfig& c = config.camera;
  const camera_calibration_t& camera = calibration.cameras.at(static_cast<std::size_t>(index));
  drivers::CameraOptions o;
  o.device = device_of(c, index);
  o.index = index;
  o.width_px = camera.width;
  o.height_px = camera.height;
  o.rate_hz = c.rate_hz;
  o.format = static_cast<drivers::CameraFormat>(c.format);
  o.buffers = c.buffers;
  o.stamp_point = static_cast<drivers::StampPoint>(c.stamp);
  o.readout_s = camera.row_time_s > 0.0 ? camera.row_time_s * camera.height : 0.0;
  o.time_offset_us = c.time_offset_us;
  o.stall_s = c.stall_s;
  o.exposure = exposure_options(c.exposure);
  return o;
}

}  // namespace farpoint::daemon
