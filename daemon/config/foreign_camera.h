// SPDX-License-Identifier: Apache-2.0
// Calibrations written by other tools: ROS camera_info, Kalibr camchain, OpenCV FileStorage.
#pragma once

#include <optional>
#include <string>

#include "daemon/config/lens.h"
#include "daemon/config/yaml_file.h"

namespace farpoint::daemon {

struct ForeignCamera {
  Lens lens;
  std::string model;                          // as the file names it
  std::string name;                           // of the chosen camera, where the file has several; else empty
  std::vector<std::string> others;            // names of its other cameras
  std::optional<slam::SE3> T_camera0_camera;  // a chain of two or more
};

enum class CalibrationKind { kFarpoint, kRos, kKalibr, kOpenCv };

// Recognises the tool by the keys at the top; kFarpoint where none fits.
[[nodiscard]] CalibrationKind kind_of(const YamlFile& yaml);
[[nodiscard]] const char* to_string(CalibrationKind kind);

// Reads a calibration of another tool. `name` chooses a camera of a chain; empty: the first. Throws
// InputError with file, line, key and what was expected. Precondition: kind is not kFarpoint.
[[nodiscard]] ForeignCamera read_foreign_camera(const YamlFile& yaml, CalibrationKind kind,
                                                const std::string& name);

// Throws InputError for calibrations of known tools that are no YAML: OpenCV's XML and JSON, ROS's INI.
void refuse_other_syntax(const std::string& content, const std::filesystem::path& file);

}  // namespace farpoint::daemon
