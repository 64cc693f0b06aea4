// SPDX-License-Identifier: Apache-2.0
// Writes a simulation as an LCM log: CALIBRATION and SIMULATION first, then IMU, WHEELS, GROUND_TRUTH and
// CAMERA_N in order of time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "tools/simulate/simulation.h"

namespace farpoint::tools::simulate {

enum class ImageFormat { kGrey, kMjpeg };

struct RecorderOptions {
  std::string output;  // a file, "-" or a device
  ImageFormat format = ImageFormat::kGrey;
  // Also writes every n-th image of camera 0 as a PNG file into a folder; 0: none.
  std::filesystem::path picture_folder;
  std::int64_t picture_every = 0;
};

struct RecorderResult {
  std::int64_t frames = 0;
  double path_m = 0.0, simulated_s = 0.0, cpu_s = 0.0;
};

// Throws InputError if the output cannot be opened, RunError after a failed write or a signal. The part
// written so far is then kept as <output>.incomplete, and replays.
RecorderResult record(Simulation* simulation, const RecorderOptions& options);

}  // namespace farpoint::tools::simulate
