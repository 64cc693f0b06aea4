// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluate/log_input.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <memory>

#include "ipc/channels.h"
#include "ipc/file_kind.h"
#include "ipc/log.h"
#include "tools/common/errors.h"

namespace farpoint::tools {
namespace {

slam::SE3 to_pose(const double position[3], const double orientation_wxyz[4]) {
  slam::SE3 pose;
  pose.t = {position[0], position[1], position[2]};
  const Eigen::Quaterniond q(orientation_wxyz[0], orientation_wxyz[1], orientation_wxyz[2],
                             orientation_wxyz[3]);
  if (q.norm() > 0.0) pose.q = q.normalized();
  return pose;
}

std::int64_t big_endian_64(std::span<const std::uint8_t> bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < 8; ++i) value = value << 8 | bytes[i];
  return static_cast<std::int64_t>(value);
}

// Time of an image message without decoding it: the fingerprint comes first, then utime (image_t.lcm).
std::optional<std::int64_t> image_utime(std::span<const std::uint8_t> data) {
  if (data.size() < 16 || big_endian_64(data) != image_t::getHash()) return std::nullopt;
  return big_endian_64(data.subspan(8));
}

std::unique_ptr<ipc::LogReader> open_log(const std::filesystem::path& file) {
  try {
    return std::make_unique<ipc::LogReader>(file.string());
  } catch (const std::runtime_error& e) {
    throw InputError(e.what());
  }
}

void report_damage(const std::filesystem::path& file, const ipc::LogDamage& damage,
                   std::uint64_t undecodable) {
  if (damage.places > 0) {
    std::fprintf(stderr, "farpoint: warning: %s: damaged in %llu places, %llu bytes skipped\n", file.c_str(),
                 static_cast<unsigned long long>(damage.places),
                 static_cast<unsigned long long>(damage.bytes));
  }
  if (!damage.read_error.empty()) throw RunError(file.string() + ": cannot be read: " + damage.read_error);
  if (undecodable > 0) {
    std::fprintf(stderr, "farpoint: warning: %s: %llu messages could not be decoded\n", file.c_str(),
                 static_cast<unsigned long long>(undecodable));
  }
}

void sort_by_time(Trajectory* trajectory) {
  std::stable_sort(trajectory->poses.begin(), trajectory->poses.end(),
                   [](const TimedPose& a, const TimedPose& b) { return a.time_s < b.time_s; });
}

// Collects one recording, message by message. Each returns false for a message that cannot be decoded.
class RecordingCollector {
 public:
  bool add(const ipc::LogEvent& event) {
    if (event.channel == "CAMERA_0") return add_frame(event);
    if (event.channel == ipc::kGroundTruthChannel) return add_truth(event);
    if (event.channel == ipc::kCalibrationChannel) return add_calibration(event);
    if (event.channel == ipc::kSimulationChannel) return ipc::decode(event.data, &log_.simulation.emplace());
    return true;
  }
  RecordingLog finish() {
    std::sort(log_.frame_utimes.begin(), log_.frame_utimes.end());
    sort_by_time(&log_.truth);
    return std::move(log_);
  }

 private:
  bool add_frame(const ipc::LogEvent& event) {
    const std::optional<std::int64_t> utime = image_utime(event.data);
    if (utime) log_.frame_utimes.push_back(*utime);
    return utime.has_value();
  }
  bool add_truth(const ipc::LogEvent& event) {
    ground_truth_t message;
    if (!ipc::decode(event.data, &message)) return false;
    const slam::SE3 pose = to_pose(message.position, message.orientation);
    if (!pose.is_finite()) return false;
    log_.truth.poses.push_back({seconds_of(message.utime), pose, 0});
    log_.truth.has_orientation = log_.truth.has_orientation && message.has_orientation != 0;
    return true;
  }
  bool add_calibration(const ipc::LogEvent& event) {
    calibration_t message;
    if (!ipc::decode(event.data, &message)) return false;
    if (!log_.calibration) log_.calibration = message;
    return true;
  }

  RecordingLog log_;
};

class RunCollector {
 public:
  bool add(const ipc::LogEvent& event) {
    if (event.channel == ipc::kPoseChannel) return add_pose(event);
    if (event.channel == ipc::kTimingChannel) return add_timing(event);
    if (event.channel == ipc::kTrajectoryChannel) return add_trajectory(event);
    if (event.channel == ipc::kLandmarksChannel) return add_landmarks(event);
    if (event.channel == ipc::kSummaryChannel) return add_summary(event);
    if (event.channel == ipc::kStatusChannel) return add_status(event);
    return true;
  }
  RunLog finish() {
    if (!log_.has_trajectory) {
      log_.scale_state = last_scale_state_;
      log_.frames = poses_;
    }
    sort_by_time(&log_.final_trajectory);
    sort_by_time(&log_.live_trajectory);
    std::stable_sort(log_.published.begin(), log_.published.end(),
                     [](const PublishedState& a, const PublishedState& b) { return a.time_s < b.time_s; });
    return std::move(log_);
  }

 private:
  bool add_landmarks(const ipc::LogEvent& event) {
    landmarks_t message;
    if (!ipc::decode(event.data, &message)) return false;
    if (!log_.landmarks) {
      log_.landmarks = std::move(message);
      return true;
    }
    auto& all = log_.landmarks->landmarks;
    std::move(message.landmarks.begin(), message.landmarks.end(), std::back_inserter(all));
    log_.landmarks->nlandmarks = static_cast<std::int32_t>(all.size());
    return true;
  }
  bool add_pose(const ipc::LogEvent& event) {
    pose_t message;
    if (!ipc::decode(event.data, &message)) return false;
    ++poses_;
    log_.has_poses = true;
    log_.resets = std::max(log_.resets, message.reset_counter);
    last_scale_state_ = message.scale_state;
    log_.published.push_back({seconds_of(message.utime), message.state, message.valid != 0});
    if (message.valid == 0) return true;
    const slam::SE3 pose = to_pose(message.position, message.orientation);
    if (!pose.is_finite()) return false;
    log_.live_trajectory.poses.push_back({seconds_of(message.utime), pose, message.map_id});
    return true;
  }
  bool add_timing(const ipc::LogEvent& event) {
    timing_t message{};
    if (!ipc::decode(event.data, &message)) return false;
    const double frame_ms = message.cpu_ms[timing_t::STAGE_FRAME];
    if (frame_ms >= 0.0) log_.frame_ms.push_back(frame_ms);
    log_.timed_frames.push_back({message.utime, message.cpu_ms[timing_t::STAGE_TRACKING],
                                 message.wall_ms[timing_t::STAGE_TRACKING], message.latency_ms,
                                 1e-6 * static_cast<double>(message.resident_bytes)});
    if (message.deadline_missed != 0) ++log_.deadline_misses;
    log_.peak_resident_bytes = std::max(log_.peak_resident_bytes, message.peak_resident_bytes);
    return true;
  }
  bool add_trajectory(const ipc::LogEvent& event) {
    trajectory_t message;
    if (!ipc::decode(event.data, &message)) return false;
    log_.has_trajectory = true;
    log_.scale_state = message.scale_state;
    log_.frames = message.frames;
    log_.final_trajectory.poses.clear();
    for (const trajectory_pose_t& p : message.poses) {
      if (p.map_id != message.map_id || p.is_final == 0) continue;
      const slam::SE3 pose = to_pose(p.position, p.orientation);
      if (!pose.is_finite()) return false;
      log_.final_trajectory.poses.push_back({seconds_of(p.utime), pose, p.map_id});
    }
    return true;
  }
  bool add_status(const ipc::LogEvent& event) {
    status_t message;
    if (!ipc::decode(event.data, &message)) return false;
    log_.last_status = std::move(message);
    return true;
  }
  bool add_summary(const ipc::LogEvent& event) {
    summary_t message;
    if (!ipc::decode(event.data, &message)) return false;
    log_.resets = std::max(log_.resets, message.reset_counter);
    log_.summary = std::move(message);
    return true;
  }

  RunLog log_;
  std::int64_t poses_ = 0;
  std::int8_t last_scale_state_ = 0;
};

template <typename Collector>
auto collect(const std::filesystem::path& file) {
  const std::unique_ptr<ipc::LogReader> reader = open_log(file);
  Collector collector;
  std::uint64_t undecodable = 0;
  ipc::LogEvent event;
  while (reader->next(&event)) {
    if (!collector.add(event)) ++undecodable;
  }
  if (reader->events() == 0) throw InputError(file.string() + ": no events, expected an LCM log");
  report_damage(file, reader->damage(), undecodable);
  return collector.finish();
}

}  // namespace

bool is_lcm_log(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || std::filesystem::is_directory(file)) {
    throw InputError(file.string() + ": cannot be read, expected an LCM log or a TUM trajectory file");
  }
  const std::string wrong = ipc::wrong_kind(file.string(), "an LCM log or a TUM trajectory file");
  if (!wrong.empty()) throw InputError(wrong);
  unsigned char head[4] = {};
  stream.read(reinterpret_cast<char*>(head), sizeof head);
  const std::uint32_t word = static_cast<std::uint32_t>(head[0]) << 24 |
                             static_cast<std::uint32_t>(head[1]) << 16 |
                             static_cast<std::uint32_t>(head[2]) << 8 | head[3];
  return word == ipc::LogReader::kSyncWord || file.extension() == ".lcm";
}

slam::SE3 RecordingLog::T_body_camera0() const {
  if (!calibration || calibration->cameras.empty()) return {};
  return to_pose(calibration->cameras[0].position, calibration->cameras[0].orientation);
}

RecordingLog read_recording_log(const std::filesystem::path& file) {
  return collect<RecordingCollector>(file);
}

RunLog read_run_log(const std::filesystem::path& file) {
  RunLog log = collect<RunCollector>(file);
  if (!log.has_trajectory && !log.has_poses) {
    throw InputError(file.string() + ": no " + ipc::kTrajectoryChannel + " and no " + ipc::kPoseChannel +
                     " messages, expected an output log of farpointd (--output)");
  }
  return log;
}

}  // namespace farpoint::tools
