// SPDX-License-Identifier: Apache-2.0
// Writes a Recording as an LCM log: CALIBRATION first, then IMU, GROUND_TRUTH and CAMERA_N in order of time.
#pragma once

#include <cstddef>
#include <filesystem>

#include "tools/import/recording.h"

namespace farpoint::tools {

// Copies the image files' bytes unchanged. Replaces an existing log atomically. Throws InputError for an
// image that cannot be read or differs in size from its camera, RunError if the log cannot be written.
void write_recording(const Recording& recording, const std::filesystem::path& log_file);

}  // namespace farpoint::tools
