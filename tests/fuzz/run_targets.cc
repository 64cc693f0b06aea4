// SPDX-License-Identifier: Apache-2.0
// Output logs of farpointd into `farpoint evaluate` and `farpoint report`.
#include <fstream>
#include <iterator>

#include "ipc/channels.h"
#include "ipc/log.h"
#include "tests/daemon/synthetic_log.h"
#include "tests/fuzz/composed_log.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/small_images.h"
#include "tests/support/paths.h"
#include "tools/common/errors.h"
#include "tools/evaluate/run_metrics.h"
#include "tools/evaluate/table.h"
#include "tools/report/report.h"

namespace farpoint::fuzz {
namespace {

constexpr double kDuration_s = 2.0;
constexpr int kFrames = 20;

simulation_t small_world() {
  std::ifstream file(test::source_dir() + "/config/worlds/yard.yaml");
  simulation_t message{};
  message.version = tools::simulate::kSimulatorVersion;
  message.world_name = "yard";
  message.world = {std::istreambuf_iterator<char>(file), {}};
  message.seed = 1;
  message.duration = kDuration_s;
  message.width = 64;
  message.height = 48;
  return message;
}

// Truth with the world of a simulated recording, made once.
const tools::Truth& truth() {
  static const tools::Truth known = [] {
    tools::Truth made;
    made.names_body = true;
    made.world = std::make_shared<tools::SimulatedWorld>(small_world());
    for (int i = 0; i < kFrames; ++i) {
      made.frame_utimes.push_back(100'000 * i);
      made.body.poses.push_back({0.1 * i, {Eigen::Quaterniond::Identity(), {0.8 * i, 0.01 * i * i, 0.0}}, 0});
    }
    return made;
  }();
  return known;
}

// A recording with truth and images, for the report.
const MemoryFile& recording() {
  static const MemoryFile file = [] {
    EventList events;
    calibration_t calibration = test::synthetic_calibration();
    events.add(ipc::kCalibrationChannel, calibration);
    std::vector<image_t> images = small_images();
    for (int i = 0; i < kFrames; ++i) {
      ground_truth_t pose{};
      pose.utime = 100'000 * i;
      pose.position[0] = 0.8 * i;
      pose.has_orientation = 1;
      pose.orientation[0] = 1.0;
      events.add(ipc::kGroundTruthChannel, pose);
      image_t& image = images[static_cast<std::size_t>(i) % images.size()];
      image.utime = 100'000 * i;
      events.add("CAMERA_0", image);
    }
    return MemoryFile(log_of(events.input()));
  }();
  return file;
}

landmarks_t two_landmarks() {
  landmarks_t message{};
  message.nlandmarks = 2;
  message.landmarks.resize(2);
  for (landmark_t& l : message.landmarks) {
    l.map_id = 1;
    l.anchor_utime = 300'000;
    l.created_utime = 800'000;
    l.anchor_pixel[0] = 20.0F;
    l.anchor_pixel[1] = 25.0F;
    l.position[0] = l.distance = 12.0;
    l.relative_sigma = 0.1F;
    l.nsightings = 3;
    l.sighting_utime = {300'000, 500'000, 800'000};
    l.sighting_u = {20.0F, 21.0F, 22.0F};
    l.sighting_v = {25.0F, 25.0F, 24.0F};
  }
  return message;
}

trajectory_t straight_trajectory() {
  trajectory_t message{};
  message.frames = kFrames;
  message.map_id = 1;
  for (int i = 0; i < 6; ++i) {
    trajectory_pose_t pose{};
    pose.utime = 200'000 * i;
    pose.map_id = 1;
    pose.position[0] = 0.5 * i;
    pose.position[1] = 0.02 * i * i;
    pose.orientation[0] = 1.0;
    pose.is_final = 1;
    message.poses.push_back(pose);
  }
  message.nposes = static_cast<std::int32_t>(message.poses.size());
  return message;
}

summary_t one_map() {
  summary_t message{};
  message.frames = kFrames;
  message.frames_valid = 15;
  message.landmarks_made = 4;
  message.configuration = "log:\n  level: info\n";
  message.nmaps = 1;
  message.maps.resize(1);
  map_summary_t& map = message.maps.front();
  map.ncreated = 2;
  map.creation_depth = {3.0F, 40.0F};
  map.creation_relative_sigma = {0.1F, 0.2F};
  map.through_vmp = {0, 1};
  return message;
}

}  // namespace

void run_evaluate(ByteView input) {
  const MemoryFile log(log_of(input));
  try {
    const tools::Run run = tools::read_run(log.path());
    for (const bool with_truth : {false, true}) {
      const tools::RunMetrics metrics = tools::evaluate_run(run, with_truth ? truth() : tools::Truth{}, {});
      require(!tools::details_text(metrics).empty() && !tools::table_text({metrics}).empty(),
              "a run has a table");
      require(!tools::to_json(metrics).dump().empty(), "a run has its JSON");
    }
  } catch (const tools::InputError&) {  // refused
  }
}

void run_report(ByteView input) {
  const MemoryFile log(log_of(input));
  for (const bool with_truth : {false, true}) {
    try {
      const tools::report::Report made =
          tools::report::make_report({{log.path()}, with_truth ? recording().path() : ""});
      constexpr std::size_t kMostBytes = std::size_t{16} << 20;
      require(made.page.size() < kMostBytes, "the report of a short run is short");
    } catch (const tools::InputError&) {  // refused
    }
  }
}

std::vector<Bytes> seeds_of_run() {
  EventList events;
  for (int i = 0; i < 4; ++i) {
    pose_t pose{};
    pose.utime = 100'000 * i;
    pose.map_id = 1;
    pose.valid = 1;
    pose.position[0] = 0.3 * i;
    pose.orientation[0] = 1.0;
    events.add(ipc::kPoseChannel, pose);
    timing_t timing{};
    timing.utime = pose.utime;
    events.add(ipc::kTimingChannel, timing);
    status_t status{};
    status.utime = pose.utime;
    events.add(ipc::kStatusChannel, status);
  }
  events.add(ipc::kMapChannel, map_t{});
  events.add(ipc::kLandmarksChannel, two_landmarks());
  events.add(ipc::kTrajectoryChannel, straight_trajectory());
  events.add(ipc::kSummaryChannel, one_map());
  Bytes raw = log_of(events.input());
  raw.insert(raw.begin(), 'R');
  return {events.input(), raw, bytes_of("R0.1 1 2 3 0 0 0 1\n0.2 1 2 4 0 0 0.7 0.7\n0.3 1 2 5 0 0 0 1\n")};
}

}  // namespace farpoint::fuzz
