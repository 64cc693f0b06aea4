// SPDX-License-Identifier: Apache-2.0
// KITTI odometry layout: ROOT/sequences/SEQUENCE/{calib.txt, times.txt, image_0/, image_1/, gps_xy.txt,
// wheels.csv} and ROOT/poses/SEQUENCE.txt. Only calib.txt (line P0) and image_0 are needed.
#pragma once

#include <filesystem>
#include <string>

#include "tools/import/recording.h"

namespace farpoint::tools {

// Line i of times.txt and of the pose file belongs to image number i (000000 is line 1); without times.txt
// images are 0.1 s apart. The data set names no body: it stands at camera 0, x forward, y left, z up. The
// truth keeps the data set's world, so its positions are the file's own; gps_xy.txt (`seconds east north`) is
// truth of position only, with z = 0, used where there is no pose file. wheels.csv (`seconds,speed_mps,
// yaw_rate_rad_per_s`, clock of times.txt) becomes wheel samples. Throws InputError naming file and line; for
// truth and wheels as `damaged` has it.
[[nodiscard]] Recording read_kitti(const std::filesystem::path& root, const std::string& sequence,
                                   Damaged damaged = Damaged::kLeftOut);

}  // namespace farpoint::tools
