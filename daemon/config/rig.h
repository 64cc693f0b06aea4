// SPDX-License-Identifier: Apache-2.0
// Converts a calibration message to the estimator's rig.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/config/config.h"
#include "daemon/config/errors.h"
#include "ipc/message.h"
#include "slam/config.h"

namespace farpoint::daemon {

// Returns the tracked camera's pose on the body and its model. Throws InputError for an incomplete or invalid
// calibration: unknown model, impossible numbers, no rotation.
[[nodiscard]] slam::Rig make_rig(const calibration_t& calibration, int camera_index);

// Index of the calibration's camera that is used beside the tracked one: the first other one that stands
// apart from it. None where camera.use is 'one', and where there is no such camera.
[[nodiscard]] std::optional<int> second_camera(const calibration_t& calibration, const CameraConfig& config);
// The tracked camera and, where there is one, the second.
[[nodiscard]] slam::Rig make_rig(const calibration_t& calibration, const CameraConfig& config);

// Memory for images of one camera: pyramids, and working memory of the extractor.
[[nodiscard]] double image_bytes(const Config& config, std::int64_t pixels);
// Largest image that capacity.image_mb allows.
[[nodiscard]] std::int64_t most_image_pixels(const Config& config);
// Throws InputError if the tracked camera's images need more than capacity.image_mb. Callers check before
// they allocate for the calibration.
void check_image_size(const calibration_t& calibration, const Config& config);

// Hash of a calibration for status and summary: FNV-1a 64 of the encoded message except its time,
// hexadecimal.
[[nodiscard]] std::string calibration_hash(const calibration_t& calibration);

}  // namespace farpoint::daemon
