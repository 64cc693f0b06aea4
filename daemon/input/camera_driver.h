// SPDX-License-Identifier: Apache-2.0
// Creates a camera from the configuration.
#pragma once

#include <memory>
#include <string>

#include "daemon/config/config.h"
#include "drivers/camera/camera.h"
#include "ipc/message.h"

namespace farpoint::daemon {

// Does not open the device; an absent camera is searched later. Throws ConfigError for a driver that this
// build or machine lacks, and for an invalid device name. Call before threads start and memory is locked,
// since a driver may be loaded. `key`: the device's key, for errors.
[[nodiscard]] std::unique_ptr<drivers::Camera> make_camera(CameraDriverChoice driver,
                                                           const drivers::CameraOptions& options,
                                                           const std::string& key);

// First CALIBRATION message of a log. Throws InputError without one.
[[nodiscard]] calibration_t calibration_of_log(const std::string& path);

}  // namespace farpoint::daemon
