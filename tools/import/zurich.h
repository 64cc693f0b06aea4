// SPDX-License-Identifier: Apache-2.0
// Zurich Urban MAV layout: ROOT/'MAV Images'/00001.jpg and ROOT/'Log Files'/{OnboardGPS, RawGyro, RawAccel,
// GroundTruthAGL}.csv, each with a heading. Stamps are microseconds. Images and OnboardGPS.csv are needed.
#pragma once

#include <filesystem>

#include "tools/import/recording.h"

namespace farpoint::tools {

// OnboardGPS.csv has the time of each image number; images that it does not name are left out. The camera
// comes from `camera_file`, since calibration_data.npz is NumPy's. An IMU sample is one of RawAccel with the
// gyroscope's last one. Truth is the camera's position in UTM, without orientation. Throws InputError naming
// file and line; for IMU and truth as `damaged` has it.
[[nodiscard]] Recording read_zurich(const std::filesystem::path& root,
                                    const std::filesystem::path& camera_file,
                                    Damaged damaged = Damaged::kLeftOut);

}  // namespace farpoint::tools
