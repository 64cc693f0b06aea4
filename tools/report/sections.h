// SPDX-License-Identifier: Apache-2.0
// The parts of a report, each as HTML; empty without data in the runs. `truth` may be null.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/report/run_record.h"

namespace farpoint::tools::report {

using Runs = std::vector<RunRecord>;

// One row of evaluation a run.
[[nodiscard]] std::string overview_section(const Runs& runs);
// Top view of final and live path, height, and each run's path coloured by its error.
[[nodiscard]] std::string trajectory_section(const Runs& runs, const Truth* truth);
// Position error and scale over the way, relative errors by length.
[[nodiscard]] std::string error_section(const Runs& runs, const Truth* truth);
// Roll, pitch, yaw and velocity over time, and their errors.
[[nodiscard]] std::string motion_section(const Runs& runs, const Truth* truth);
[[nodiscard]] std::string timing_section(const Runs& runs);
// Features, matches, track lengths and times side by side, with ratios to the first run.
[[nodiscard]] std::string workload_section(const Runs& runs);
// Distances at which points were made and seen, and on a simulated world their errors.
[[nodiscard]] std::string landmark_section(const Runs& runs);
// Life times of virtual map points before they became points.
[[nodiscard]] std::string vmp_section(const Runs& runs);
[[nodiscard]] std::string map_section(const Runs& runs);
// Tracks drawn over frames of the recording, which has the images, the runs' side by side; empty without one.
[[nodiscard]] std::string track_section(const Runs& runs, const std::filesystem::path& recording);
// States and faults on a time line; queues and memory over time.
[[nodiscard]] std::string health_section(const Runs& runs);
[[nodiscard]] std::string configuration_section(const Runs& runs);

}  // namespace farpoint::tools::report
