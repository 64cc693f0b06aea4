// A Recording as an LCM log: CALIBRATION first, then IMU, GROUND_TRUTH and CAMERA_N in the order of their
// times.
#pragma once

#include <cstddef>
#include <filesystem>

#include "tools/import/recording.h"

namespace farpoint::tools {

// Copies the image files' bytes as they are. The file appears whole or not at all and replaces an existing
// one. Throws InputError for an image that cannot be read or has another size than its camera, RunError where
// the log cannot be written.
void write_recording(const Recording& recording, const std::filesystem::path& log_file);

}  // namespace farpoint::tools
