// SPDX-License-Identifier: Apache-2.0
// Made-up recordings and output logs of runs for the tests of `evaluate` and `report`.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>

#include "tools/trajectory/trajectory.h"

namespace farpoint::tools {

// A recording's log: truth, one CAMERA_0 message a pose, camera 0 at `lever_arm` on the body.
void write_recording_log(const std::filesystem::path& file, const Trajectory& truth,
                         const std::string& body_name, const Eigen::Vector3d& lever_arm);

// What a run publishes: final over every frame, live from frame `first_live` on.
struct MadeRun {
  Trajectory final_trajectory;
  std::size_t first_live = 10;
  std::int8_t scale_state = 0;               // status_t.SCALE_*
  bool ended = true;                         // FARPOINT_TRAJECTORY and FARPOINT_SUMMARY are there
  bool tracking_timed = true;                // else only the whole frame is
  std::size_t blind_from = 0, blind_to = 0;  // frames published without a valid pose in between
  std::size_t other_map_from = 0;            // from this frame on another map, 1 km away; 0: never
};
void write_run_log(const std::filesystem::path& file, const MadeRun& run);

}  // namespace farpoint::tools
