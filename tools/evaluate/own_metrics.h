// SPDX-License-Identifier: Apache-2.0
// Figures of a run that need no truth: validity, losses, path length, counts of the map, drops.
//
// Words, here and in `report` and `top`. A landmark with a depth is a point, one without is a virtual map
// point (VMP); landmarks are both. summary_t.landmarks and status_t.landmarks count both, of all maps;
// map_summary_t.landmarks counts the points of one map.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "tools/common/json.h"
#include "tools/evaluate/log_input.h"

namespace farpoint::tools {

// Landmarks alive, of all maps.
struct MapCounts {
  std::int64_t keyframes = 0, points = 0, vmps = 0;
};
[[nodiscard]] MapCounts map_counts(const summary_t& summary);
[[nodiscard]] MapCounts map_counts(const status_t& status);

// A trajectory by itself.
struct PathMetrics {
  std::size_t poses = 0;
  double share = 0.0;   // of all frames of the recording
  double length = 0.0;  // in OwnMetrics::length_unit; steps from one map to another are left out
};
[[nodiscard]] PathMetrics measure_path(const Trajectory& trajectory, std::int64_t frames);

struct OwnMetrics {
  const char* length_unit = "m";  // "map units" while the scale is unknown, "units" of a text file
  double duration_s = 0.0;        // first to last frame published, or first to last pose of a text file
  PathMetrics final_path;
  std::optional<PathMetrics> live_path;  // empty: the run is a text file

  // From an output log only.
  std::optional<double> first_valid_s;    // from the first published frame to the first valid pose
  std::optional<double> longest_blind_s;  // without a new valid pose, from the first one to the last frame
  std::array<double, 8> state_percent{};  // of the published frames, by status_t.STATE_*
  std::optional<std::int64_t> frames_dropped, keyframes_dropped;  // as the last status counted them
  std::optional<MapCounts> map;                                   // at the end
};

// `final_trajectory`: of the text file where `log` is null. `frames`: of the recording.
[[nodiscard]] OwnMetrics measure_own(const RunLog* log, const Trajectory& final_trajectory,
                                     std::int64_t frames);

[[nodiscard]] Json to_json(const OwnMetrics& metrics);
// Lines led by the run's name, one fact a key.
[[nodiscard]] std::string own_text(const std::string& run, const OwnMetrics& metrics);

}  // namespace farpoint::tools
