// SPDX-License-Identifier: Apache-2.0
// TUM RGB-D layout: rgb.txt (`timestamp filename`), the images it names, groundtruth.txt
// (`timestamp tx ty tz qx qy qz qw` of the colour camera). Depth is not read.
#pragma once

#include <filesystem>

#include "tools/import/recording.h"

namespace farpoint::tools {

// The intrinsics come from a camera file, since the data set keeps them on a web page. Without T_body_camera
// in it the body stands at the camera, x forward, y left, z up. The truth keeps the data set's world and is
// turned into the body's. groundtruth.txt may be absent. Images that are listed but absent are counted and
// left out. Throws InputError naming file and line; for truth as `damaged` has it.
[[nodiscard]] Recording read_tum_rgbd(const std::filesystem::path& folder,
                                      const std::filesystem::path& camera_file,
                                      Damaged damaged = Damaged::kLeftOut);

}  // namespace farpoint::tools
