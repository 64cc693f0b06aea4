// SPDX-License-Identifier: Apache-2.0
// Content of one run's output log for a report, in order of time.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ipc/message.h"
#include "tools/evaluate/run_metrics.h"

namespace farpoint::tools::report {

// A frame as it was published.
struct PublishedFrame {
  std::int64_t utime = 0;
  double time_s = 0.0;
  std::int8_t state = 0;  // status_t.STATE_*
  bool valid = false;
  int features = 0, matches = 0, inliers = 0;
  bool keyframe = false;
  std::int32_t map_id = 0;
};

// Velocity as it was published, in body axes.
struct PublishedVelocity {
  double time_s = 0.0;
  Eigen::Vector3d linear;   // map units a second
  Eigen::Vector3d angular;  // rad/s
};

struct RunRecord {
  std::string name;
  Run run;
  std::optional<RunMetrics> metrics;  // where there is truth
  OwnMetrics own;
  std::vector<PublishedFrame> frames;
  std::vector<PublishedVelocity> velocities;  // valid ones
  // Valid poses as published, of the map that has most of them: poses of another map have another origin.
  Trajectory live;
  std::vector<timing_t> timings;
  std::vector<status_t> statuses;
  std::optional<map_t> map;  // the last one published
  double start_s = 0.0;      // of the first frame published
  slam::Sim3 S_world_live;   // see world_from_live_map()

  [[nodiscard]] const landmarks_t* landmarks() const;
  [[nodiscard]] const summary_t* summary() const;
  // Metres a map unit by the alignment; 1 without truth.
  [[nodiscard]] double scale() const;
  // Map coordinates to the world's, by the final and by the live trajectory; identity without truth.
  [[nodiscard]] slam::Sim3 world_from_map() const;
  [[nodiscard]] const slam::Sim3& world_from_live_map() const { return S_world_live; }
  [[nodiscard]] bool is_threaded() const;  // in lockstep no frame has a latency
  [[nodiscard]] double end_s() const;      // of the last frame published; start_s without one
  [[nodiscard]] std::string length_unit() const;
};

// `truth`: null without one. Throws InputError unless the file is an output log of farpointd.
[[nodiscard]] RunRecord read_run_record(const std::filesystem::path& file, const Truth* truth);

}  // namespace farpoint::tools::report
