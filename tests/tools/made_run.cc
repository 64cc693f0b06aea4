// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/made_run.h"

#include <cmath>

#include "ipc/channels.h"
#include "ipc/log.h"
#include "ipc/message.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

std::int64_t utime_of(const TimedPose& p) {
  return std::llround(p.time_s * 1e6);
}

template <typename Message>
void set_pose(const slam::SE3& pose, Message* message) {
  for (int k = 0; k < 3; ++k) message->position[k] = pose.t[k];
  message->orientation[0] = pose.q.w();
  message->orientation[1] = pose.q.x();
  message->orientation[2] = pose.q.y();
  message->orientation[3] = pose.q.z();
}

map_summary_t make_map_summary() {
  map_summary_t map{};
  map.landmarks = 1234;
  for (int i = 0; i < 101; ++i) {  // depths 0 .. 100 in map units, and one too uncertain to count
    map.creation_depth.push_back(static_cast<float>(i));
    map.creation_relative_sigma.push_back(0.1F);
    map.through_vmp.push_back(0);
  }
  map.creation_depth.push_back(1e6F);
  map.creation_relative_sigma.push_back(0.31F);
  map.through_vmp.push_back(1);
  map.ncreated = static_cast<std::int32_t>(map.creation_depth.size());
  map.observations = 5000;
  map.observation_distance_p10 = 2.0;
  map.observation_distance_median = 20.0;
  map.observation_distance_p90 = 40.0;
  return map;
}

summary_t make_summary(const MadeRun& run) {
  summary_t summary{};
  summary.frames = static_cast<std::int64_t>(run.final_trajectory.poses.size());
  summary.frames_valid = summary.frames - static_cast<std::int64_t>(run.first_live);
  summary.landmarks_made = 2000;
  summary.vmp_promoted = 100;
  summary.reset_counter = 3;
  summary.times_lost = 2;
  summary.maps_made = 4;
  summary.landmarks = 1500;
  summary.vmps = 266;
  summary.keyframes = 50;
  summary.maps = {make_map_summary()};
  summary.nmaps = 1;
  return summary;
}

trajectory_t make_trajectory(const MadeRun& run) {
  trajectory_t trajectory{};
  trajectory.map_id = 7;
  trajectory.scale_state = run.scale_state;
  trajectory.frames = static_cast<std::int64_t>(run.final_trajectory.poses.size());
  for (const TimedPose& p : run.final_trajectory.poses) {
    trajectory_pose_t pose{};
    pose.utime = utime_of(p);
    pose.map_id = 7;
    pose.is_final = 1;
    set_pose(p.pose, &pose);
    trajectory.poses.push_back(pose);
  }
  trajectory_pose_t elsewhere = trajectory.poses.front();  // another, smaller map: not part of the trajectory
  elsewhere.map_id = 8;
  elsewhere.position[0] += 1e3;
  trajectory.poses.push_back(elsewhere);
  trajectory.nposes = static_cast<std::int32_t>(trajectory.poses.size());
  return trajectory;
}

// 1.5 odom units a second ahead, two map units each.
void write_motion(const pose_t& pose, ipc::LogWriter* log) {
  odometry_t odometry{};
  odometry.utime = pose.utime;
  odometry.valid = odometry.velocity_valid = pose.valid;
  odometry.velocity[0] = 1.5;
  odometry.angular_velocity[2] = 0.1;
  log->write_message(ipc::kOdometryChannel, pose.utime, odometry);
  map_from_odom_t correction{};
  correction.utime = pose.utime;
  correction.scale = 2.0;
  log->write_message(ipc::kMapFromOdomChannel, pose.utime, correction);
}

status_t make_status(std::int64_t utime) {
  status_t status{};
  status.utime = utime;
  status.landmarks = 1490;
  status.vmps = 300;
  status.frames_dropped = 4;
  return status;
}

}  // namespace

void write_recording_log(const fs::path& file, const Trajectory& truth, const std::string& body_name,
                         const Eigen::Vector3d& lever_arm) {
  ipc::LogWriter log(file.string());
  calibration_t calibration{};
  calibration.body_name = body_name;
  calibration.ncameras = 1;
  calibration.cameras.resize(1);
  set_pose({Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), lever_arm}, &calibration.cameras[0]);
  log.write_message(ipc::kCalibrationChannel, 0, calibration);
  for (const TimedPose& p : truth.poses) {
    ground_truth_t message{};
    message.utime = utime_of(p);
    message.has_orientation = truth.has_orientation ? 1 : 0;
    set_pose(p.pose, &message);
    log.write_message(ipc::kGroundTruthChannel, message.utime, message);
    image_t image{};
    image.utime = message.utime;
    log.write_message("CAMERA_0", message.utime, image);
  }
  log.close();
}

void write_run_log(const fs::path& file, const MadeRun& run) {
  ipc::LogWriter log(file.string());
  for (std::size_t i = 0; i < run.final_trajectory.poses.size(); ++i) {
    const TimedPose& p = run.final_trajectory.poses[i];
    pose_t pose{};
    pose.utime = utime_of(p);
    pose.map_id = 7;
    pose.scale_state = run.scale_state;
    pose.valid = i >= run.first_live && !(i >= run.blind_from && i < run.blind_to) ? 1 : 0;
    pose.state = pose.valid != 0 ? status_t::STATE_TRACKING : status_t::STATE_INITIALISING;
    pose.keyframe = i % 2 == 0 ? 1 : 0;
    set_pose(p.pose, &pose);
    if (pose.valid == 0) pose.position[0] = 1e6;  // must never be counted
    if (run.other_map_from > 0 && i >= run.other_map_from) {
      pose.map_id = 9;
      pose.position[0] += 1e3;
    }
    log.write_message(ipc::kPoseChannel, pose.utime, pose);
    write_motion(pose, &log);
    timing_t timing{};
    timing.utime = pose.utime;
    for (double& ms : timing.cpu_ms) ms = -1.0;
    timing.cpu_ms[timing_t::STAGE_TRACKING] = static_cast<double>(i);
    if (!run.tracking_timed)
      std::swap(timing.cpu_ms[timing_t::STAGE_TRACKING], timing.cpu_ms[timing_t::STAGE_FRAME]);
    timing.deadline_missed = i == 5 ? 1 : 0;
    timing.latency_ms = 7.0 + static_cast<double>(i);
    timing.peak_resident_bytes = 1'000'000 * (100 + i);
    log.write_message(ipc::kTimingChannel, pose.utime, timing);
  }
  if (!run.final_trajectory.poses.empty())
    log.write_message(ipc::kStatusChannel, 0, make_status(utime_of(run.final_trajectory.poses.back())));
  if (run.ended) {
    log.write_message(ipc::kTrajectoryChannel, 0, make_trajectory(run));
    log.write_message(ipc::kSummaryChannel, 0, make_summary(run));
  }
  log.close();
}

}  // namespace farpoint::tools
