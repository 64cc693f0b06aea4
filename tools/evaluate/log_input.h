// SPDX-License-Identifier: Apache-2.0
// Reads LCM logs for evaluation and export: a recording's truth and farpointd's output.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ipc/message.h"
#include "tools/evaluate/run_times.h"
#include "tools/trajectory/trajectory.h"

namespace farpoint::tools {

// Returns true for an LCM log: by its first bytes, or by the ending .lcm if they are damaged. Throws
// InputError if the file cannot be read.
[[nodiscard]] bool is_lcm_log(const std::filesystem::path& file);

struct RecordingLog {
  std::optional<calibration_t> calibration;  // the first one
  Trajectory truth;                          // T_world_body, ascending; may be empty
  std::vector<std::int64_t> frame_utimes;    // of CAMERA_0, ascending
  std::optional<simulation_t> simulation;    // of a simulated recording

  // T_body_camera of camera 0; identity without a calibration.
  [[nodiscard]] slam::SE3 T_body_camera0() const;
};
// Throws InputError if the file cannot be read. Skips damage and reports it in one line on standard error.
[[nodiscard]] RecordingLog read_recording_log(const std::filesystem::path& file);

// A frame as it was published.
struct PublishedState {
  double time_s = 0.0;
  std::int8_t state = 0;  // status_t.STATE_*
  bool valid = false;
};

struct RunLog {
  Trajectory final_trajectory;  // the map with most frames, after the last optimisation
  Trajectory live_trajectory;   // poses published as valid, map frame, every map
  bool has_trajectory = false;  // the log has a FARPOINT_TRAJECTORY (farpointd ended in order)
  bool has_poses = false;       // at least one FARPOINT_POSE, valid or not
  std::int64_t frames = 0;      // of the recording, as counted by the run
  std::int8_t scale_state = 0;  // status_t.SCALE_*
  std::int32_t resets = 0;      // highest reset counter published
  std::optional<summary_t> summary;
  std::optional<landmarks_t> landmarks;
  std::optional<status_t> last_status;
  std::vector<PublishedState> published;  // ascending in time
  std::vector<TimedFrame> timed_frames;
  std::vector<double> frame_ms;  // thread CPU time of whole frames, mapping included where it runs in step
  std::int64_t deadline_misses = 0;
  std::int64_t peak_resident_bytes = 0;  // 0: unknown
};
// Throws InputError if the file cannot be read or holds neither FARPOINT_TRAJECTORY nor FARPOINT_POSE.
[[nodiscard]] RunLog read_run_log(const std::filesystem::path& file);

}  // namespace farpoint::tools
