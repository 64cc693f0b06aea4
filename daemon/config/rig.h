// From the log's calibration message to the estimator's rig.
#pragma once

#include <string>

#include "daemon/config/errors.h"
#include "ipc/message.h"
#include "slam/config.h"

namespace farpoint::daemon {

// The tracked camera's place on the body and its model. Throws InputError where the calibration does not
// describe that camera completely (unknown model, numbers that make no camera, orientation that is no
// rotation).
[[nodiscard]] slam::Rig make_rig(const calibration_t& calibration, int camera_index);

// Names a calibration in status and summary: FNV-1a 64 of the encoded message but its time, hexadecimal.
[[nodiscard]] std::string calibration_hash(const calibration_t& calibration);

}  // namespace farpoint::daemon
