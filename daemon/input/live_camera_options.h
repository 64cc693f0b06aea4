// SPDX-License-Identifier: Apache-2.0
// What the configuration asks of the live cameras: calibration and options for the driver.
#pragma once

#include <string>
#include <vector>

#include "daemon/config/config.h"
#include "drivers/camera/camera.h"
#include "ipc/message.h"

namespace farpoint::daemon {

// Calibration of the cameras of a live run. Appends what a person should know about the files to *notices.
// Throws ConfigError or InputError.
[[nodiscard]] calibration_t read_live_calibration(const Config& config, std::vector<std::string>* notices);

// Key of a camera's device: 0 the tracked one, 1 the second.
[[nodiscard]] const std::string& device_of(const CameraConfig& camera, int index);

// The driver's options of one camera, numbered like this.
[[nodiscard]] drivers::CameraOptions camera_options(const Config& config, const calibration_t& calibration,
                                                    int index);
[[nodiscard]] drivers::ExposureOptions exposure_options(const ExposureConfig& config);

}  // namespace farpoint::daemon
