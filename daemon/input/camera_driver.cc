// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/camera_driver.h"

#include <stdexcept>

#include "daemon/config/errors.h"
#include "drivers/camera/live_camera.h"
#include "drivers/lcm/socket_camera.h"
#include "drivers/log/log_camera.h"
#if FARPOINT_WITH_V4L2
#include "drivers/v4l2/v4l2_device.h"
#endif
#if FARPOINT_WITH_LIBCAMERA
#include "drivers/libcamera/libcamera_device.h"
#include "drivers/libcamera/libcamera_loader.h"
#endif

namespace farpoint::daemon {
namespace {

void require_name(const std::string& problem, const std::string& key) {
  if (!problem.empty()) throw ConfigError("configuration: " + key + ": " + problem);
}

#if !FARPOINT_WITH_V4L2 || !FARPOINT_WITH_LIBCAMERA
[[noreturn]] void fail_not_built(const std::string& driver, const std::string& option) {
  throw ConfigError("configuration: camera.driver: " + driver + ": this farpointd was built without it (-D" +
                    option + "=ON, and its packages), expected another driver or --replay");
}
#endif

std::unique_ptr<drivers::Camera> make_v4l2([[maybe_unused]] const drivers::CameraOptions& options,
                                           [[maybe_unused]] const std::string& key) {
#if FARPOINT_WITH_V4L2
  require_name(drivers::CameraPath::check(options.device), key);
  auto device = std::make_unique<drivers::V4l2Device>(options, std::make_unique<drivers::LinuxV4l2System>());
  return std::make_unique<drivers::LiveCamera>(options, std::move(device));
#else
  fail_not_built("v4l2", "FARPOINT_V4L2");
#endif
}

std::unique_ptr<drivers::Camera> make_libcamera([[maybe_unused]] const drivers::CameraOptions& options,
                                                [[maybe_unused]] const std::string& key) {
#if FARPOINT_WITH_LIBCAMERA
  require_name(drivers::LibcameraDevice::check(options.device), key);
  std::string problem;
  auto system = drivers::load_libcamera(drivers::libcamera_module_path(), &problem);
  if (!system)
    throw ConfigError("configuration: camera.driver: libcamera: its module cannot be loaded: " + problem);
  auto device = std::make_unique<drivers::LibcameraDevice>(options, std::move(system));
  return std::make_unique<drivers::LiveCamera>(options, std::move(device));
#else
  fail_not_built("libcamera", "FARPOINT_LIBCAMERA");
#endif
}

std::unique_ptr<drivers::Camera> make_file(const drivers::CameraOptions& options) {
  return std::make_unique<drivers::LiveCamera>(options, std::make_unique<drivers::LogCamera>(options));
}

std::unique_ptr<drivers::Camera> make_lcm(const drivers::CameraOptions& options, const std::string& key) {
  require_name(drivers::SocketCamera::check(options.device), key);
  return std::make_unique<drivers::LiveCamera>(options, std::make_unique<drivers::SocketCamera>(options));
}

}  // namespace

std::unique_ptr<drivers::Camera> make_camera(CameraDriverChoice driver, const drivers::CameraOptions& options,
                                             const std::string& key) {
  switch (driver) {
    case CameraDriverChoice::kV4l2:
      return make_v4l2(options, key);
    case CameraDriverChoice::kLibcamera:
      return make_libcamera(options, key);
    case CameraDriverChoice::kFile:
      return make_file(options);
    case CameraDriverChoice::kLcm:
      return make_lcm(options, key);
  }
  return nullptr;
}

calibration_t calibration_of_log(const std::string& path) {
  try {
    drivers::LogSource source(path);
    for (drivers::LogItem item; source.next(&item);)
      if (item.kind == drivers::LogItemKind::kCalibration) return *item.calibration;
  } catch (const std::runtime_error& error) {
    throw InputError(error.what());
  }
  throw InputError(path + ": no CALIBRATION message, expected one (camera.calibration: log)");
}

}  // namespace farpoint::daemon
