// SPDX-License-Identifier: Apache-2.0
#include <spdlog/fmt/fmt.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstring>
#include <stdexcept>

#include "daemon/check/checks.h"
#include "daemon/config/errors.h"
#include "daemon/config/mask_file.h"
#include "daemon/config/rig.h"
#include "daemon/input/live_camera_options.h"
#include "drivers/camera/camera_path.h"
#include "drivers/lcm/socket_camera.h"
#include "drivers/log/log_source.h"
#if FARPOINT_WITH_V4L2
#include "drivers/v4l2/v4l2_inspect.h"
#endif
#if FARPOINT_WITH_LIBCAMERA
#include "drivers/libcamera/libcamera_device.h"
#include "drivers/libcamera/libcamera_loader.h"
#endif

namespace farpoint::daemon {
namespace {

// One camera that is looked at.
struct Looked {
  const drivers::CameraOptions& options;
  const std::string what;  // of its lines
  Findings* findings;

  void ok(const std::string& sentence) const { findings->ok(what, options.device + ": " + sentence); }
  void warn(const std::string& sentence) const { findings->warn(what, options.device + ": " + sentence); }
  void fail(const std::string& sentence) const { findings->fail(what, options.device + ": " + sentence); }
};

#if FARPOINT_WITH_V4L2
std::string reason(const drivers::V4l2Look& look) {
  if (look.path.empty()) return look.what;
  std::string text = look.path + ": " + look.what + " (" + std::strerror(look.error) + ")";
  if (look.error == EACCES) text += ", expected an account of group video";
  return text;
}

void check_v4l2(const Looked& camera, const std::string& root) {
  const drivers::CameraOptions& o = camera.options;
  if (const std::string problem = drivers::CameraPath::check(o.device); !problem.empty())
    return camera.findings->fail(camera.what, problem);
  const drivers::V4l2Look look = root.empty() ? drivers::inspect_v4l2(o) : [&] {
    drivers::LinuxV4l2System system;
    return drivers::inspect_v4l2(&system, o, root);
  }();
  if (look.error != 0) return camera.fail(reason(look));
  if (access(look.path.c_str(), R_OK | W_OK) != 0)
    return camera.fail("this account may not write to it, expected one of group video");
  const std::string offer = fmt::format("{} of driver {}, {} x {} in {}", look.path, look.driver, o.width_px,
                                        o.height_px, to_string(look.offered.format));
  const double fastest = look.offered.fastest_hz;
  if (fastest <= 0.0) return camera.ok(offer + ", at a rate that the driver does not list");
  if (!look.offered.reaches(o.rate_hz))
    return camera.warn(fmt::format("{} at no more than {:.4g} Hz, expected {:.4g} Hz (camera.rate_hz)", offer,
                                   fastest, o.rate_hz));
  camera.ok(fmt::format("{} at up to {:.4g} Hz", offer, fastest));
}
#else
void check_v4l2(const Looked& camera, const std::string& /*root*/) {
  camera.fail("this farpointd was built without V4L2, expected another camera.driver");
}
#endif

#if FARPOINT_WITH_LIBCAMERA
void check_libcamera(const Looked& camera) {
  if (const std::string problem = drivers::LibcameraDevice::check(camera.options.device); !problem.empty())
    return camera.findings->fail(camera.what, problem);
  std::string problem;
  if (!drivers::load_libcamera(drivers::libcamera_module_path(), &problem))
    return camera.fail("the module for libcamera cannot be loaded: " + problem);
  camera.ok(
      "the module for libcamera loads; whether the camera is there is not looked at ('cam -l' lists them)");
}
#else
void check_libcamera(const Looked& camera) {
  camera.fail("this farpointd was built without libcamera, expected another camera.driver");
}
#endif

void check_file(const Looked& camera) {
  const drivers::CameraOptions& o = camera.options;
  try {
    drivers::LogSource source(o.device);
    for (drivers::LogItem item; source.next(&item);) {
      if (item.kind != drivers::LogItemKind::kImage || item.camera != o.index) continue;
      if (item.image->width != o.width_px || item.image->height != o.height_px)
        return camera.fail(fmt::format("images of {} x {}, expected {} x {} (the calibration)",
                                       item.image->width, item.image->height, o.width_px, o.height_px));
      return camera.ok(fmt::format("a log with images of {} x {}, as a camera", o.width_px, o.height_px));
    }
  } catch (const std::runtime_error& error) {
    return camera.findings->fail(camera.what, error.what());
  }
  camera.fail("a log without an image on CAMERA_" + std::to_string(o.index));
}

void check_socket(const Looked& camera) {
  const std::string& path = camera.options.device;
  if (const std::string problem = drivers::SocketCamera::check(path); !problem.empty())
    return camera.findings->fail(camera.what, problem);
  struct stat status {};
  if (stat(path.c_str(), &status) != 0)
    return camera.fail(std::string(std::strerror(errno)) +
                       ", expected the socket of the process that gives the images");
  if (!S_ISSOCK(status.st_mode))
    return camera.fail("no socket, expected that of the process with the images");
  if (access(path.c_str(), R_OK | W_OK) != 0) return camera.fail("this account may not use the socket");
  camera.ok("a socket; its images are not looked at");
}

void check_camera(CameraDriverChoice driver, const Looked& camera, const std::string& root) {
  switch (driver) {
    case CameraDriverChoice::kV4l2:
      return check_v4l2(camera, root);
    case CameraDriverChoice::kLibcamera:
      return check_libcamera(camera);
    case CameraDriverChoice::kFile:
      return check_file(camera);
    case CameraDriverChoice::kLcm:
      return check_socket(camera);
  }
}

void check_mask(const CameraConfig& config, const calibration_t& calibration, int index, Findings* findings) {
  const std::string what = index == 0 ? "mask" : "second mask", key = index == 0 ? "mask" : "second_mask";
  const std::string& file = index == 0 ? config.mask : config.second_mask;
  if (file == "none") return findings->ok(what, "none (camera." + key + ")");
  if (index >= static_cast<int>(calibration.cameras.size()))
    return findings->warn(what, fmt::format("{}: not used, since there is no camera {}", file, index));
  const camera_calibration_t& camera = calibration.cameras[static_cast<std::size_t>(index)];
  try {
    const auto mask = read_mask(config, index, camera.width, camera.height);
    findings->ok(what, fmt::format("{}: {:.1f} % of the image", file, 100.0 * mask->share()));
  } catch (const ConfigError& error) {
    findings->fail(what, error.what());
  }
}

}  // namespace

std::string described(const calibration_t& calibration) {
  std::string text;
  for (const camera_calibration_t& camera : calibration.cameras)
    text += fmt::format("{}{} x {}, {}, focal length {:.1f} px", text.empty() ? "" : "; ", camera.width,
                        camera.height, camera.model, camera.fx);
  return text + ", hash " + calibration_hash(calibration);
}

std::optional<calibration_t> check_calibration(const Config& config, Findings* findings) {
  const std::string what = "calibration";
  try {
    std::vector<std::string> notices;
    calibration_t calibration = read_live_calibration(config, &notices);
    (void)make_rig(calibration, config.camera.index);
    for (const std::string& notice : notices) findings->warn(what, notice);
    findings->ok(what, config.camera.calibration + ": " + described(calibration));
    return calibration;
  } catch (const std::runtime_error& error) {
    findings->fail(what, error.what());
    return {};
  }
}

void check_cameras(const Config& config, const calibration_t& calibration, const std::string& root,
                   Findings* findings) {
  const int cameras = config.camera.has_second() ? 2 : 1;
  for (int index = 0; index < cameras; ++index) {
    const drivers::CameraOptions options = camera_options(config, calibration, index);
    check_camera(config.camera.driver, {options, index == 0 ? "camera" : "second camera", findings}, root);
  }
}

void check_masks(const Config& config, const calibration_t& calibration, Findings* findings) {
  check_mask(config.camera, calibration, 0, findings);
  if (calibration.cameras.size() > 1 || config.camera.second_mask != "none")
    check_mask(config.camera, calibration, 1, findings);
}

}  // namespace farpoint::daemon
