// SPDX-License-Identifier: Apache-2.0
// Camera files (config/cameras/*.yaml): one calibrated camera, every key explained in
// config/cameras/README.md. Calibrations of ROS, Kalibr and OpenCV are read the same way, recognised by
// content.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ipc/message.h"
#include "slam/config.h"

namespace farpoint::daemon {

struct CameraFile {
  slam::Camera::Parameters parameters;
  std::optional<slam::SE3> T_body_camera;  // empty: the file names no body
  double rate_hz = 0.0;                    // nominal; 0 unknown
  double row_time_s = -1.0;                // rolling shutter: one row to the next; 0 global; negative unknown
  // What a person should know about it, a line each: a conversion and its error, a camera that looks up.
  std::vector<std::string> notices;
};

// FILE#NAME chooses a camera of a Kalibr chain where FILE#NAME is no file. Throws InputError with file, line,
// key and what was expected.
[[nodiscard]] CameraFile read_camera_file(const std::filesystem::path& file);
// Reads a file's content; `file` names it in errors, `name` chooses a camera of a chain (empty: the first).
[[nodiscard]] CameraFile parse_camera_file(const std::string& content, const std::filesystem::path& file,
                                           const std::string& name = "");

// Returns the calibration message of a vehicle with this one camera.
[[nodiscard]] calibration_t calibration_of(const CameraFile& camera, const std::string& name);
// The same with two, CAMERA_0 and CAMERA_1, read from their files. Appends what both files' notices say. Also
// throws InputError for a file without T_body_camera, since the relative pose would be unknown.
[[nodiscard]] calibration_t read_stereo_calibration(const std::filesystem::path& first,
                                                    const std::filesystem::path& second,
                                                    std::vector<std::string>* notices);

}  // namespace farpoint::daemon
