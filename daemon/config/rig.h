// SPDX-License-Identifier: Apache-2.0
// Converts a calibration message to the estimator's rig.
#pragma once

#include <string>

#include "daemon/config/errors.h"
#include "ipc/message.h"
#include "slam/config.h"

namespace farpoint::daemon {

// Returns the tracked camera's pose on the body and its model. Throws InputError for an incomplete or invalid
// calibration: unknown model, impossible numbers, no rotation.
[[nodiscard]] slam::Rig make_rig(const calibration_t& calibration, int camera_index);

// Hash of a calibration for status and summary: FNV-1a 64 of the encoded message except its time,
// hexadecimal.
[[nodiscard]] std::string calibration_hash(const calibration_t& calibration);

}  // namespace farpoint::daemon
