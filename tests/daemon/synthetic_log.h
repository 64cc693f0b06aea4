// SPDX-License-Identifier: Apache-2.0
// Short recorded logs for tests, made from a world of small textured squares.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ipc/message.h"

namespace farpoint::test {

struct SyntheticLog {
  int frames = 60;
  double step_m =
      0.15;  // the camera's way between two frames, along x and z of the camera; 0: it stands still
  std::int64_t period_us = 100'000;
  bool with_calibration = true;
  int camera = 0;  // which camera sends the images
};

// Pinhole camera of 480x320 px without a body.
[[nodiscard]] calibration_t synthetic_calibration();
// One grey image of the world, seen from step * number.
[[nodiscard]] image_t synthetic_image(const SyntheticLog& log, int number);
// CALIBRATION, then images; event timestamps are deliberately not the images' utime.
void write_synthetic_log(const std::string& path, const SyntheticLog& log);

// The first `frames` images of a KITTI sequence of recorded data (left camera) as a log; false where they are
// absent.
bool write_kitti_log(const std::string& sequence_folder, int frames, const std::string& path);

}  // namespace farpoint::test
