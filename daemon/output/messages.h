// SPDX-License-Identifier: Apache-2.0
// From the estimator's results to the messages of ipc/types. Pure functions: the same input gives the same
// bytes.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "bot_core/pose_t.hpp"
#include "daemon/config/config.h"
#include "daemon/output/pose_sink.h"
#include "ipc/message.h"
#include "ipc/reason.h"
#include "slam/inspection.h"

namespace farpoint::daemon {

// A pose that is not known is NaN throughout, never zeros or the last one; quality is -1 unless the pose is
// valid.
[[nodiscard]] odometry_t make_odometry(const FrameOutput& frame);
[[nodiscard]] pose_t make_pose(const FrameOutput& frame);
[[nodiscard]] map_from_odom_t make_map_from_odom(const FrameOutput& frame);
// For viewers of the MIT tools, whose message has no validity: send it for valid frames only.
[[nodiscard]] bot_core::pose_t make_bot_core_pose(const FrameOutput& frame);

// What a viewer can draw.
struct MapContent {
  std::vector<slam::LandmarkInfo> landmarks;  // of all maps
  std::vector<slam::SE3> keyframes;           // T_map_body, oldest first
};
// The landmarks of the frame's map, at most max_points of them (every n-th), and the keyframes given; lengths
// times unit_scale.
[[nodiscard]] map_t make_map(const FrameOutput& frame, const MapContent& content, int max_points,
                             double unit_scale);

// Everything the end of a run is summarised from.
struct RunEnd {
  std::int64_t utime = 0;               // of the last frame
  std::int64_t first_utime = 0;         // of the first frame
  std::int64_t initialised_utime = -1;  // of the first frame with a map; -1: none had one
  slam::FrameResult last;               // with scale.assumed applied
  std::int64_t frames = 0;              // of the recording, posed or not
  std::int64_t frames_valid = 0;
  // By reason: frames without a valid pose, and the numbers of the last one.
  std::array<std::int64_t, ipc::kReasons> refused{};
  std::array<slam::Refusal, ipc::kReasons> refusals{};
  std::vector<std::int64_t> live_utimes;                   // of valid frames, ascending
  std::vector<slam::MapTrajectory> trajectories;           // most frames first
  std::vector<slam::LandmarkInfo> landmarks;               // alive, of all maps
  std::vector<std::vector<double>> observation_distances;  // of each map of `trajectories`
  slam::EstimatorCounts counts;
  double unit_scale = 1.0;  // published units a map unit
};
[[nodiscard]] trajectory_t make_trajectory(const RunEnd& end);
// Of `part` (of end.landmarks) what has become a point, with what `sightings` gives of each.
using SightingsOf = std::function<std::vector<slam::LandmarkSighting>(const slam::LandmarkInfo&)>;
[[nodiscard]] landmarks_t make_landmarks(const RunEnd& end, std::span<const slam::LandmarkInfo> part,
                                         const SightingsOf& sightings);
// Counts of refused input, configuration, build and hashes are the caller's to fill.
[[nodiscard]] summary_t make_summary(const RunEnd& end, const Config& config);

// Value below which the share q (0..1) of the sorted values lies, linear between neighbours; NaN where there
// are none.
[[nodiscard]] double quantile(std::span<const double> sorted, double q);

}  // namespace farpoint::daemon
