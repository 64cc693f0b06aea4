// SPDX-License-Identifier: Apache-2.0
#include "tools/report/frame_table.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <map>

#include "slam/frame_result.h"
#include "tools/report/motion.h"

namespace farpoint::tools::report {
namespace {

constexpr char kHead[] =
    "time_s,state,valid,map_id,keyframe,features,matches,inliers,length_unit,"
    "final_x,final_y,final_z,final_roll_deg,final_pitch_deg,final_yaw_deg,"
    "live_x,live_y,live_z,live_roll_deg,live_pitch_deg,live_yaw_deg,"
    "velocity_x_per_s,velocity_y_per_s,velocity_z_per_s,yaw_rate_deg_per_s,"
    "truth_x,truth_y,truth_z,truth_roll_deg,truth_pitch_deg,truth_yaw_deg,"
    "final_position_error,final_rotation_error_deg,live_position_error,live_rotation_error_deg,"
    "tracking_cpu_ms,latency_ms,resident_mb\n";
constexpr double kDegreesPerRadian = 57.29577951308232;

// By the log's microseconds: a time in seconds is not exact.
template <typename Item>
using ByTime = std::map<std::int64_t, Item>;

std::int64_t key_of(double time_s) {
  constexpr double kMost_s = 9e12;  // of int64_t microseconds
  return std::abs(time_s) < kMost_s ? std::llround(1e6 * time_s) : 0;
}

ByTime<slam::SE3> poses_by_time(const Trajectory& trajectory) {
  ByTime<slam::SE3> poses;
  for (const TimedPose& p : trajectory.poses) poses[key_of(p.time_s)] = p.pose;
  return poses;
}

// Truth at the times of the published frames, at the point that the run was compared at.
ByTime<slam::SE3> truth_by_time(const RunRecord& run, const Truth* truth) {
  ByTime<slam::SE3> poses;
  if (truth == nullptr) return poses;
  Trajectory frames;
  for (const PublishedFrame& f : run.frames) frames.poses.push_back({f.time_s, {}, 0});
  for (const PosePair& pair : pair_nearest(truth_for(run, *truth), frames))
    poses[key_of(pair.time_s)] = pair.T_world_body;
  return poses;
}

template <typename Item>
const Item* at(const ByTime<Item>& items, double time_s) {
  const auto found = items.find(key_of(time_s));
  return found == items.end() ? nullptr : &found->second;
}

std::string cell(double value, int digits) {
  return std::isfinite(value) ? fmt::format(",{:.{}f}", value, digits) : ",";
}

std::string cells(const Eigen::Vector3d& values, int digits) {
  return cell(values.x(), digits) + cell(values.y(), digits) + cell(values.z(), digits);
}

std::string pose_cells(const slam::SE3* pose, bool has_orientation = true) {
  if (pose == nullptr) return ",,,,,,";
  return cells(pose->t, 4) + (has_orientation ? cells(roll_pitch_yaw_deg(pose->q), 4) : ",,,");
}

std::string error_cells(const slam::SE3* truth, const slam::SE3* estimate, bool has_orientation) {
  if (truth == nullptr || estimate == nullptr) return ",,";
  const double turn_deg =
      kDegreesPerRadian * slam::so3_log((truth->q.conjugate() * estimate->q).normalized()).norm();
  return cell((estimate->t - truth->t).norm(), 4) + (has_orientation ? cell(turn_deg, 4) : ",");
}

std::string time_cells(const timing_t* timing) {
  if (timing == nullptr) return ",,,";
  const auto measured = [](double ms) { return ms >= 0.0 ? ms : NAN; };
  return cell(measured(timing->cpu_ms[timing_t::STAGE_TRACKING]), 3) + cell(measured(timing->latency_ms), 3) +
         cell(1e-6 * static_cast<double>(timing->resident_bytes), 1);
}

}  // namespace

std::string frame_table(const RunRecord& run, const Truth* truth) {
  const ByTime<slam::SE3> final_poses =
      poses_by_time(moved_by(run.world_from_map(), run.run.final_trajectory));
  const ByTime<slam::SE3> live_poses = poses_by_time(moved_by(run.world_from_live_map(), run.live));
  const ByTime<slam::SE3> truth_poses = truth_by_time(run, truth);
  ByTime<PublishedVelocity> velocities;
  for (const PublishedVelocity& v : run.velocities) velocities[key_of(v.time_s)] = v;
  ByTime<const timing_t*> timings;
  for (const timing_t& t : run.timings) timings[key_of(seconds_of(t.utime))] = &t;

  const bool turns = truth != nullptr && truth->body.has_orientation;
  const std::string unit = run.length_unit();
  std::string text = kHead;
  for (const PublishedFrame& f : run.frames) {
    const slam::SE3 *final_pose = at(final_poses, f.time_s), *live_pose = at(live_poses, f.time_s),
                    *truth_pose = at(truth_poses, f.time_s);
    const PublishedVelocity* velocity = at(velocities, f.time_s);
    const timing_t* const* timing = at(timings, f.time_s);
    text += fmt::format("{:.6f},{},{},{},{},{},{},{},{}", f.time_s,
                        slam::to_string(static_cast<slam::State>(f.state)), f.valid ? 1 : 0, f.map_id,
                        f.keyframe ? 1 : 0, f.features, f.matches, f.inliers, unit);
    text += pose_cells(final_pose) + pose_cells(live_pose);
    text += velocity == nullptr ? ",,,,"
                                : cells(run.world_from_live_map().scale * velocity->linear, 4) +
                                      cell(kDegreesPerRadian * velocity->angular.z(), 4);
    text += pose_cells(truth_pose, turns) + error_cells(truth_pose, final_pose, turns) +
            error_cells(truth_pose, live_pose, turns);
    text += time_cells(timing == nullptr ? nullptr : *timing) + "\n";
  }
  return text;
}

}  // namespace farpoint::tools::report
