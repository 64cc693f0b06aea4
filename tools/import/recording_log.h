// SPDX-License-Identifier: Apache-2.0
// Writes a Recording as an LCM log: CALIBRATION first, then IMU, GROUND_TRUTH and CAMERA_N in order of time.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

#include "tools/import/recording.h"

namespace farpoint::tools {

// The bytes of an image of a recording: a PNG or JPEG file, or pixels as its `raw` describes them.
using ImageSource = std::function<std::string(const RecordingImage&)>;

// Copies the image files' bytes unchanged; with `source` each image's bytes are those that it returns, asked
// for in order of time. Replaces an existing log atomically. Throws InputError for an image that cannot be
// read or differs in size from its camera, RunError if the log cannot be written.
void write_recording(const Recording& recording, const std::filesystem::path& log_file,
                     const ImageSource& source = {});

}  // namespace farpoint::tools
