// SPDX-License-Identifier: Apache-2.0
// Metrics of one run, against truth where there is one.
//
// Definitions. final: every frame's pose in the map with most frames, after the last optimisation. live: the
// map-frame poses that were published as valid. share: poses with truth, of all frames of the recording.
// own: figures that need no truth (own_metrics.h). Points are landmarks with a depth.
// Triangulation depth: distance from the newest observing keyframe to the point when it was made; observation
// distance: camera to point, over all observations of the final map; both in metres by the final alignment's
// scale, depths only of points that survived and whose relative depth sigma was under 30 %.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/common/json.h"
#include "tools/evaluate/accuracy.h"
#include "tools/evaluate/landmark_metrics.h"
#include "tools/evaluate/log_input.h"
#include "tools/evaluate/own_metrics.h"
#include "tools/evaluate/run_times.h"

namespace farpoint::tools {

// The point of the vehicle that is compared with truth.
enum class TruthPoint {
  kAuto,  // camera 0 where the run's scale is unknown (its body then stands there), else the body
  kBody,
  kCamera0,
};

// A range of frames of the recording: from, up to but not including `to`.
struct FrameRange {
  std::size_t from = 0, to = 0;
};

struct EvaluationOptions {
  std::optional<Alignment> alignment;  // nothing: se3 for a run of metric scale, else sim3
  bool planar = false;
  TruthPoint truth_point = TruthPoint::kAuto;
  std::optional<std::int64_t> frames;  // of the recording; nothing: from the truth's log, else from the run
  std::vector<FrameRange> segments;    // of the final trajectory, each aligned by itself
};

struct Truth {
  Trajectory body;                         // T_world_body
  slam::SE3 T_body_camera0;                // identity where the truth is a text file
  bool names_body = false;                 // a lever arm is known: camera 0 is not the body
  std::vector<std::int64_t> frame_utimes;  // of CAMERA_0; empty where the truth is a text file
  std::shared_ptr<SimulatedWorld> world;   // of a simulated recording, where asked for

  [[nodiscard]] bool is_known() const { return !body.poses.empty(); }
};
// Reads truth from a recording's log or a TUM file. `with_world`: makes a simulated recording's world again,
// to judge landmarks. Throws InputError, also for a log without truth.
[[nodiscard]] Truth read_truth(const std::filesystem::path& file, bool with_world = false);
// The same, except that a recording without GROUND_TRUTH gives its frames and an unknown truth.
[[nodiscard]] Truth read_reference(const std::filesystem::path& file, bool with_world = false);

// A run as given on the command line.
struct Run {
  std::string name;           // stem of the file
  std::optional<RunLog> log;  // nothing: the file is a TUM trajectory
  Trajectory final_trajectory;
};
[[nodiscard]] Run read_run(const std::filesystem::path& file);

struct TrajectoryMetrics {
  std::size_t poses = 0;   // of the estimate
  std::size_t paired = 0;  // of them, with truth
  double share = 0.0;
  std::optional<AbsoluteError> absolute;     // nothing: fewer than three pairs: lost
  std::optional<SegmentError> segments;      // nothing: path under 100 m, or truth of position only
  std::optional<OneSecondError> one_second;  // nothing: truth of position only
};

struct Spread {
  std::size_t count = 0;
  double p10 = 0.0, p50 = 0.0, p90 = 0.0;
};

struct DepthMetrics {
  Spread triangulation_m;
  double over_50_m_percent = 0.0, over_100_m_percent = 0.0;  // of the triangulation depths
  Spread observation_m;
};

struct SegmentScale {
  FrameRange range;
  std::size_t paired = 0;
  std::optional<double> scale;  // metres a map unit, from this segment alone
  std::optional<double> ratio_to_first;
};

struct RunMetrics {
  std::string name;
  bool compared = true;  // with truth; else what follows has no errors, scale or alignment
  Alignment alignment = Alignment::kSim3;
  bool planar = false;
  const char* truth_point = "body";
  const char* scale_state = "not told by a text file";
  std::int64_t images = 0;  // frames of the recording
  TrajectoryMetrics final_metrics;
  std::optional<TrajectoryMetrics> live_metrics;  // nothing: the run is a TUM file
  std::vector<SegmentScale> segments;
  OwnMetrics own;

  // From an output log only.
  std::optional<double> tracked_percent;  // frames published with a valid pose
  std::optional<std::int64_t> resets, times_lost, maps;
  std::vector<double>
      tracking_ms;               // thread CPU time of tracking; empty where the run did not measure it alone
  std::vector<double> frame_ms;  // of a whole frame: in lockstep, tracking and mapping
  std::optional<std::int64_t> deadline_misses;
  std::optional<double> peak_resident_mb;  // of the process, up to the last frame; 10^6 bytes
  std::optional<LatencyMetrics> latency;
  std::optional<SteadinessMetrics> steadiness;
  std::optional<DepthMetrics> depth;
  std::optional<std::int64_t> map_points;    // of the map with most frames
  std::optional<double> vmp_percent;         // points made through a virtual map point, of all points made
  std::vector<JudgedLandmark> judged;        // of the map with most frames, where the truth has a world
  std::optional<LandmarkMetrics> landmarks;  // their figures
};

// An unknown truth gives the figures that need none. Throws InputError for options that the truth cannot
// serve.
[[nodiscard]] RunMetrics evaluate_run(const Run& run, const Truth& truth, const EvaluationOptions& options);

// Every figure by name; absent ones are null. The absolute error has the key names of the field's scripts.
[[nodiscard]] Json to_json(const RunMetrics& metrics);

}  // namespace farpoint::tools
