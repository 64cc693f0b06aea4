// SPDX-License-Identifier: Apache-2.0
// Reads camera masks (keys camera.mask, camera.second_mask): PNG files, 8-bit grey, 0 is masked.
#pragma once

#include <memory>
#include <string>

#include "daemon/config/config.h"
#include "ipc/message.h"
#include "slam/config.h"

namespace farpoint::daemon {

// Null where the key is 'none' or the camera has no key. Throws ConfigError naming key, file and what was
// expected: no such file, no PNG file of 8-bit grey, another size than the camera's, too much masked.
[[nodiscard]] std::shared_ptr<const slam::ImageMask> read_mask(const CameraConfig& config, int camera,
                                                               int width_px, int height_px);

// Gives the rig's cameras their masks: the tracked one, and second_camera() where there is one. Masks of the
// calibration's other cameras are read and checked all the same. Throws as read_mask() does. Logs the share
// of each mask.
void read_masks(const CameraConfig& config, const calibration_t& calibration, slam::Rig* rig);

}  // namespace farpoint::daemon
