// SPDX-License-Identifier: Apache-2.0
// EuRoC (ASL) layout: mav0/{cam0,cam1,imu0,state_groundtruth_estimate0}/{data.csv,sensor.yaml}. Only cam0 is
// needed.
#pragma once

#include <filesystem>

#include "tools/import/recording.h"

namespace farpoint::tools {

// `root` holds mav0 or is it. The body is the data set's (at the IMU, T_BS = T_body_sensor), and the truth is
// the body's, in the data set's world. Images that are listed but absent, or that one side of the pair lacks,
// are counted and left out. Nanoseconds are rounded to microseconds. Throws InputError naming file and line;
// for IMU and truth as `damaged` has it.
[[nodiscard]] Recording read_euroc(const std::filesystem::path& root, Damaged damaged = Damaged::kLeftOut);

}  // namespace farpoint::tools
