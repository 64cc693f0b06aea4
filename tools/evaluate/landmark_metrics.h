// SPDX-License-Identifier: Apache-2.0
// Figures of judged landmarks: error by true distance, claims against errors, and how early far ones became
// points.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "tools/common/json.h"
#include "tools/evaluate/landmark_truth.h"

namespace farpoint::tools {

// Landmarks whose true distance lies in [from_m, to_m).
struct DistanceBin {
  double from_m = 0.0, to_m = 0.0;
  std::size_t count = 0;
  // Of distance, in percent of the true one: median and 90th percentile of its size, median with its sign.
  double error_p50_percent = 0.0, error_p90_percent = 0.0, bias_percent = 0.0;
  double claimed_percent = 0.0;  // median claimed sigma
  // Spread of the error of inverse distance in claimed sigmas (1.4826 times its median size): 1 for honest
  // claims, more for sigmas that are too small.
  double sigmas = 0.0;
  double position_error_m = 0.0;  // median, drift of the path included
};

// Age of the points beyond a distance when they were made.
struct FarBirths {
  double beyond_m = 0.0;
  std::size_t count = 0, through_vmp = 0;
  double share_percent = 0.0;  // of all landmarks on surfaces and outlines
  // Medians: from the first sighting to the point, true parallax then, true distance then.
  double wait_s = 0.0, wait_m = 0.0, parallax_deg = 0.0, born_at_m = 0.0;
};

struct LandmarkMetrics {
  std::size_t count = 0, on_sky = 0, on_moving = 0, at_outlines = 0;  // of all; the others lie on surfaces
  std::size_t refused = 0;                                            // left out: JudgedLandmarks::refused
  std::vector<DistanceBin> bins;                                      // surfaces only
  std::vector<FarBirths> far;                                         // surfaces and outlines
};

[[nodiscard]] LandmarkMetrics measure_landmarks(const std::vector<JudgedLandmark>& landmarks);

[[nodiscard]] Json to_json(const LandmarkMetrics& metrics);
// Two small tables, each line led by the run's name.
[[nodiscard]] std::string landmarks_text(const std::string& run, const LandmarkMetrics& metrics);

}  // namespace farpoint::tools
