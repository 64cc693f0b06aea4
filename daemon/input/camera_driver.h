// From the configuration to a camera.
#pragma once

#include <memory>
#include <string>

#include "daemon/config/config.h"
#include "drivers/camera/camera.h"

namespace farpoint::daemon {

// Opens nothing: a camera that is not there yet is waited for. Throws ConfigError where this build or machine
// has not got the driver, or the device is not named as the driver wants it. Before threads are started and
// memory is locked: a driver may be loaded. `key`: what names the device in the configuration, for
// complaints.
[[nodiscard]] std::unique_ptr<drivers::Camera> make_camera(CameraDriverChoice driver,
                                                           const drivers::CameraOptions& options,
                                                           const std::string& key);

}  // namespace farpoint::daemon
