// SPDX-License-Identifier: Apache-2.0
#include "tools/report/run_record.h"

#include <algorithm>
#include <map>

#include "ipc/channels.h"
#include "ipc/log.h"
#include "tools/common/errors.h"
#include "tools/report/motion.h"

namespace farpoint::tools::report {
namespace {

void add_pose(const ipc::LogEvent& event, RunRecord* record) {
  pose_t m;
  if (!ipc::decode(event.data, &m)) return;
  record->frames.push_back({m.utime, seconds_of(m.utime), m.state, m.valid != 0, m.features, m.matches,
                            m.inliers, m.keyframe != 0, m.map_id});
}

// Velocities come in odom units; the frame's map_from_odom_t, which may come later, has the map's.
class VelocityReader {
 public:
  void add(const ipc::LogEvent& event) {
    if (event.channel == ipc::kOdometryChannel) add_odometry(event);
    if (event.channel == ipc::kMapFromOdomChannel) add_scale(event);
  }
  [[nodiscard]] std::vector<PublishedVelocity> finish() const {
    std::vector<PublishedVelocity> velocities;
    for (const odometry_t& m : odometry_) {
      const auto later = map_units_an_odom_unit_.upper_bound(m.utime);
      const double scale = later == map_units_an_odom_unit_.begin() ? 1.0 : std::prev(later)->second;
      velocities.push_back({seconds_of(m.utime), scale * Eigen::Map<const Eigen::Vector3d>(m.velocity),
                            Eigen::Map<const Eigen::Vector3d>(m.angular_velocity)});
    }
    return velocities;
  }

 private:
  void add_odometry(const ipc::LogEvent& event) {
    odometry_t m;
    if (ipc::decode(event.data, &m) && m.valid != 0 && m.velocity_valid != 0) odometry_.push_back(m);
  }
  void add_scale(const ipc::LogEvent& event) {
    map_from_odom_t m;
    if (ipc::decode(event.data, &m)) map_units_an_odom_unit_[m.utime] = m.scale;
  }

  std::vector<odometry_t> odometry_;
  std::map<std::int64_t, double> map_units_an_odom_unit_;
};

template <typename Message>
void add(const ipc::LogEvent& event, std::vector<Message>* messages) {
  Message m;
  if (ipc::decode(event.data, &m)) messages->push_back(std::move(m));
}

void read_messages(const std::filesystem::path& file, RunRecord* record) {
  ipc::LogReader reader(file.string());
  ipc::LogEvent event;
  VelocityReader velocities;
  while (reader.next(&event)) {
    velocities.add(event);
    if (event.channel == ipc::kPoseChannel) add_pose(event, record);
    if (event.channel == ipc::kTimingChannel) add(event, &record->timings);
    if (event.channel == ipc::kStatusChannel) add(event, &record->statuses);
    if (event.channel == ipc::kMapChannel) {
      map_t map;
      if (ipc::decode(event.data, &map)) record->map = std::move(map);
    }
  }
  record->velocities = velocities.finish();
}

Trajectory of_fullest_map(const Trajectory& live) {
  std::map<std::int32_t, std::size_t> poses;
  for (const TimedPose& p : live.poses) ++poses[p.map_id];
  const auto fullest = std::max_element(poses.begin(), poses.end(),
                                        [](const auto& a, const auto& b) { return a.second < b.second; });
  return poses.size() < 2 ? live : of_map(fullest->first, live);
}

// The evaluation aligns the poses of all maps at once, as a receiver met them; a picture shows one map.
slam::Sim3 alignment_of_live(const RunRecord& record, const Truth& truth) {
  const RunMetrics& metrics = *record.metrics;
  if (!metrics.live_metrics || !metrics.live_metrics->absolute) return {};
  const slam::Sim3& of_all = metrics.live_metrics->absolute->map_to_world.S_world_map;
  if (record.live.poses.size() == record.run.log->live_trajectory.poses.size()) return of_all;
  const auto found =
      align(pair_nearest(truth_for(record, truth), record.live), metrics.alignment, metrics.planar);
  return found ? found->S_world_map : of_all;
}

}  // namespace

const landmarks_t* RunRecord::landmarks() const {
  return run.log && run.log->landmarks ? &*run.log->landmarks : nullptr;
}

const summary_t* RunRecord::summary() const {
  return run.log && run.log->summary ? &*run.log->summary : nullptr;
}

slam::Sim3 RunRecord::world_from_map() const {
  if (!metrics || !metrics->final_metrics.absolute) return {};
  return metrics->final_metrics.absolute->map_to_world.S_world_map;
}

bool RunRecord::is_threaded() const {
  return std::any_of(timings.begin(), timings.end(), [](const timing_t& t) { return t.latency_ms >= 0.0; });
}

double RunRecord::end_s() const {
  return frames.empty() ? start_s : frames.back().time_s;
}

double RunRecord::scale() const {
  return world_from_map().scale;
}

std::string RunRecord::length_unit() const {
  const bool metric = run.log && run.log->scale_state != status_t::SCALE_UNKNOWN;
  return (metrics && metrics->final_metrics.absolute) || metric ? "m" : "map units";
}

RunRecord read_run_record(const std::filesystem::path& file, const Truth* truth) {
  if (!is_lcm_log(file))
    throw InputError(file.string() + ": expected an output log of farpointd (--output), not a text file");
  RunRecord record;
  record.run = read_run(file);
  record.name = record.run.name;
  RunMetrics metrics = evaluate_run(record.run, truth != nullptr ? *truth : Truth{}, {});
  record.own = metrics.own;
  if (record.run.log) record.live = of_fullest_map(record.run.log->live_trajectory);
  if (truth != nullptr) record.metrics = std::move(metrics);
  if (truth != nullptr) record.S_world_live = alignment_of_live(record, *truth);
  read_messages(file, &record);
  if (!record.frames.empty()) record.start_s = record.frames.front().time_s;
  return record;
}

}  // namespace farpoint::tools::report
