// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/messages.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "daemon/config/calibration_message.h"
#include "daemon/output/sound_frames.h"

namespace farpoint::daemon {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
// METHOD.md: depth figures count only points whose relative depth sigma is under 30 %.
constexpr double kCountedRelativeSigma = 0.30;
constexpr int kQuantiles = 101;
// The estimator gives keyframe poses without their times.
constexpr std::int64_t kUnknownUtime = -1;

// The estimate as published: NaN where there is none.
slam::SE3 known(bool has_pose, const slam::SE3& T) {
  if (has_pose) return T;
  slam::SE3 unknown;
  unknown.q.coeffs().setConstant(kNan);
  unknown.t.setConstant(kNan);
  return unknown;
}

void set_matrix(const slam::Matrix6d& m, double (*rows)[6]) {
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c < 6; ++c) rows[r][c] = m(r, c);
  }
}

void set_covariances(const FrameOutput& frame, odometry_t* m) {
  const slam::FrameResult& r = frame.result;
  const auto set = [&](const slam::Matrix6d& covariance, double(*rows)[6]) {
    set_matrix(frame.valid ? covariance : slam::unknown_covariance(), rows);
  };
  set(r.odometry.since_reset(r.T_odom_body), m->pose_covariance);
  set(r.velocity_covariance, m->twist_covariance);
  set(r.odometry.noise, m->noise_covariance);
  set(r.odometry.drift, m->drift_covariance);
  m->scale_sigma = frame.valid ? r.odometry.scale_sigma : kNan;
}

std::int8_t quality_of(const FrameOutput& frame) {
  return static_cast<std::int8_t>(frame.valid ? std::clamp(frame.result.quality, -1, 100) : -1);
}

std::vector<double> sorted(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values;
}

map_summary_t make_map_summary(const RunEnd& end, std::size_t index) {
  const slam::MapTrajectory& trajectory = end.trajectories[index];
  map_summary_t m{};
  m.map_id = trajectory.map_id;
  m.frames = static_cast<std::int64_t>(trajectory.frames.size());
  std::vector<double> counted_depths;
  for (const slam::LandmarkInfo& landmark : end.landmarks) {
    if (landmark.map_id != m.map_id || !landmark.full) continue;
    const double depth = landmark.creation_depth * end.unit_scale;
    ++m.landmarks;
    m.landmarks_through_vmp += landmark.through_vmp ? 1 : 0;
    m.creation_depth.push_back(static_cast<float>(depth));
    m.creation_relative_sigma.push_back(static_cast<float>(landmark.creation_relative_sigma));
    m.through_vmp.push_back(landmark.through_vmp ? 1 : 0);
    if (landmark.creation_relative_sigma < kCountedRelativeSigma) counted_depths.push_back(depth);
  }
  m.ncreated = m.landmarks;
  counted_depths = sorted(std::move(counted_depths));
  m.creation_depth_p10 = quantile(counted_depths, 0.1);
  m.creation_depth_median = quantile(counted_depths, 0.5);
  m.creation_depth_p90 = quantile(counted_depths, 0.9);

  const std::vector<double> distances = sorted(end.observation_distances[index]);
  m.observations = static_cast<std::int64_t>(distances.size());
  m.observation_distance_p10 = quantile(distances, 0.1) * end.unit_scale;
  m.observation_distance_median = quantile(distances, 0.5) * end.unit_scale;
  m.observation_distance_p90 = quantile(distances, 0.9) * end.unit_scale;
  m.nquantiles = distances.empty() ? 0 : kQuantiles;
  for (int i = 0; i < m.nquantiles; ++i) {
    const double q = static_cast<double>(i) / (kQuantiles - 1);
    m.observation_distance_quantile.push_back(static_cast<float>(quantile(distances, q) * end.unit_scale));
  }
  return m;
}

void set_counts(const slam::EstimatorCounts& counts, summary_t* s) {
  const slam::MappingCounts& mapping = counts.mapping;
  const auto signed_count = [](std::uint64_t n) { return static_cast<std::int64_t>(n); };
  s->frames_rejected = signed_count(counts.frames_rejected);
  s->keyframes_made = signed_count(mapping.keyframes_made);
  s->keyframes_culled = signed_count(mapping.keyframes_culled);
  s->maps_made = signed_count(counts.maps);
  s->times_lost = signed_count(counts.lost);
  s->landmarks_made = signed_count(mapping.landmarks_made);
  s->landmarks_culled = signed_count(mapping.landmarks_culled);
  s->landmarks_fused = signed_count(mapping.landmarks_fused);
  s->vmp_made = signed_count(mapping.vmp_made);
  s->vmp_attached = signed_count(mapping.vmp_attached);
  s->vmp_merged = signed_count(mapping.vmp_merged);
  s->vmp_promoted = signed_count(mapping.vmp_promoted);
  s->vmp_rejected = signed_count(mapping.vmp_rejected);
  s->vmp_evicted = signed_count(mapping.vmp_evicted);
  s->local_ba = signed_count(mapping.local_ba);
  s->keyframes = static_cast<std::int32_t>(counts.keyframes);
  s->landmarks = static_cast<std::int32_t>(counts.landmarks);
  s->vmps = static_cast<std::int32_t>(mapping.vmp_alive);
}

}  // namespace

odometry_t make_odometry(const FrameOutput& frame) {
  const slam::FrameResult& r = frame.result;
  odometry_t m{};
  m.utime = r.utime;
  m.publish_utime = r.utime + frame.age_us;
  m.sequence = r.sequence;
  set_pose(known(r.has_pose, r.T_odom_body), m.position, m.orientation);
  const Eigen::Vector3d unknown = Eigen::Vector3d::Constant(kNan);
  const bool moves = frame.valid && r.knows_velocity();
  set_vector(moves ? Eigen::Vector3d(r.velocity_body.head<3>()) : unknown, m.velocity);
  set_vector(moves ? Eigen::Vector3d(r.velocity_body.tail<3>()) : unknown, m.angular_velocity);
  set_covariances(frame, &m);
  m.state = static_cast<std::int8_t>(r.state);
  m.scale_state = static_cast<std::int8_t>(r.scale);
  m.quality = quality_of(frame);
  m.valid = frame.valid ? 1 : 0;
  m.velocity_valid = moves ? 1 : 0;
  m.from_vision = r.has_pose && r.from_vision ? 1 : 0;
  m.map_id = r.map_id;
  m.reset_counter = static_cast<std::int32_t>(r.reset_counter);
  m.boot_counter = frame.boot_counter;
  return m;
}

pose_t make_pose(const FrameOutput& frame) {
  const slam::FrameResult& r = frame.result;
  pose_t m{};
  m.utime = r.utime;
  m.sequence = r.sequence;
  m.map_id = r.map_id;
  set_pose(known(r.has_pose, r.T_map_body), m.position, m.orientation);
  set_matrix(frame.valid ? r.covariance : slam::Matrix6d::Constant(kNan), m.covariance);
  m.state = static_cast<std::int8_t>(r.state);
  m.scale_state = static_cast<std::int8_t>(r.scale);
  m.quality = quality_of(frame);
  m.valid = frame.valid ? 1 : 0;
  m.reset_counter = static_cast<std::int32_t>(r.reset_counter);
  m.view_sequence = static_cast<std::int64_t>(r.view_sequence);
  m.features = r.features;
  m.matches = r.matches;
  m.inliers = r.inliers;
  m.aligned = r.aligned;
  m.keyframe = r.keyframe ? 1 : 0;
  return m;
}

map_from_odom_t make_map_from_odom(const FrameOutput& frame) {
  const slam::FrameResult& r = frame.result;
  map_from_odom_t m{};
  m.utime = r.utime;
  m.map_id = r.map_id;
  set_vector(r.map_from_odom.t, m.position);
  set_quaternion(r.map_from_odom.q, m.orientation);
  m.scale = r.map_from_odom.scale;
  m.scale_state = static_cast<std::int8_t>(r.scale);
  m.reset_counter = static_cast<std::int32_t>(r.reset_counter);
  return m;
}

bot_core::pose_t make_bot_core_pose(const FrameOutput& frame) {
  const slam::FrameResult& r = frame.result;
  bot_core::pose_t m{};
  m.utime = r.utime;
  set_pose(r.T_map_body, m.pos, m.orientation);
  set_vector(r.T_map_body.q * r.velocity_in_map().head<3>(), m.vel);
  set_vector(r.velocity_body.tail<3>(), m.rotation_rate);
  return m;
}

map_t make_map(const FrameOutput& frame, const MapContent& content, int max_points, double unit_scale) {
  const slam::FrameResult& r = frame.result;
  map_t m{};
  m.utime = r.utime;
  m.map_id = r.map_id;
  m.scale_state = static_cast<std::int8_t>(r.scale);
  std::vector<const slam::LandmarkInfo*> wanted;
  for (const slam::LandmarkInfo& landmark : content.landmarks) {
    if (landmark.map_id == r.map_id && landmark.position_map.allFinite()) wanted.push_back(&landmark);
  }
  const auto limit = static_cast<std::size_t>(max_points);
  const std::size_t stride = limit == 0 ? 1 : (wanted.size() + limit - 1) / limit;
  for (std::size_t i = 0; limit > 0 && i < wanted.size(); i += std::max<std::size_t>(stride, 1)) {
    const slam::LandmarkInfo& landmark = *wanted[i];
    const Eigen::Vector3f p = (landmark.position_map * unit_scale).cast<float>();
    m.x.push_back(p.x());
    m.y.push_back(p.y());
    m.z.push_back(p.z());
    const double relative = landmark.inverse_depth_sigma / landmark.inverse_depth;
    m.relative_sigma.push_back(static_cast<float>(relative));
    // The estimator does not say which of the others have no depth at all yet.
    m.landmark_state.push_back(landmark.full ? std::int8_t{map_t::LANDMARK_FULL}
                                             : std::int8_t{map_t::LANDMARK_WEAK});
    m.through_vmp.push_back(landmark.through_vmp ? 1 : 0);
  }
  m.npoints = static_cast<std::int32_t>(m.x.size());
  for (const slam::SE3& T_map_body : content.keyframes) {
    std::vector<double> pose(7);
    set_pose(T_map_body, pose.data(), pose.data() + 3);
    for (int i = 0; i < 3; ++i) pose[static_cast<std::size_t>(i)] *= unit_scale;
    m.keyframe_pose.push_back(std::move(pose));
  }
  m.nkeyframes = static_cast<std::int32_t>(m.keyframe_pose.size());
  m.keyframe_utime.assign(m.keyframe_pose.size(), kUnknownUtime);
  return m;
}

trajectory_t make_trajectory(const RunEnd& end) {
  trajectory_t m{};
  m.utime = end.utime;
  m.map_id = end.trajectories.empty() ? -1 : end.trajectories.front().map_id;
  m.nmaps = static_cast<std::int32_t>(end.trajectories.size());
  m.scale_state = static_cast<std::int8_t>(end.last.scale);
  m.frames = end.frames;
  for (const slam::MapTrajectory& trajectory : end.trajectories) {
    const std::vector<std::uint8_t> sound = sound_frames(trajectory, end.live_utimes);
    for (std::size_t i = 0; i < trajectory.frames.size(); ++i) {
      const slam::PosedFrame& frame = trajectory.frames[i];
      trajectory_pose_t pose{};
      pose.utime = frame.utime;
      pose.map_id = trajectory.map_id;
      set_pose(frame.T_map_body, pose.position, pose.orientation);
      for (double& x : pose.position) x *= end.unit_scale;
      pose.is_final = sound[i] != 0 ? 1 : 0;
      pose.was_live = std::binary_search(end.live_utimes.begin(), end.live_utimes.end(), frame.utime) ? 1 : 0;
      m.poses.push_back(pose);
    }
  }
  m.nposes = static_cast<std::int32_t>(m.poses.size());
  return m;
}

landmarks_t make_landmarks(const RunEnd& end, std::span<const slam::LandmarkInfo> part,
                           const SightingsOf& sightings) {
  landmarks_t m{};
  m.utime = end.utime;
  m.scale_state = static_cast<std::int8_t>(end.last.scale);
  for (const slam::LandmarkInfo& info : part) {
    if (!info.full || !(info.inverse_depth > 0.0)) continue;
    landmark_t l{};
    l.map_id = info.map_id;
    l.through_vmp = info.through_vmp ? 1 : 0;
    l.anchor_utime = info.anchor_utime;
    l.anchor_camera = info.anchor_camera;
    for (int i = 0; i < 2; ++i) l.anchor_pixel[i] = static_cast<float>(info.anchor_pixel[i]);
    set_vector(info.anchor_map * end.unit_scale, l.anchor_position);
    set_vector(info.position_map * end.unit_scale, l.position);
    l.distance = end.unit_scale / info.inverse_depth;
    l.relative_sigma = static_cast<float>(info.inverse_depth_sigma / info.inverse_depth);
    l.created_utime = info.created_utime;
    l.creation_depth = static_cast<float>(info.creation_depth * end.unit_scale);
    l.creation_relative_sigma = static_cast<float>(info.creation_relative_sigma);
    for (const slam::LandmarkSighting& s : sightings(info)) {
      l.sighting_utime.push_back(s.utime);
      l.sighting_u.push_back(s.pixel.x());
      l.sighting_v.push_back(s.pixel.y());
    }
    l.nsightings = static_cast<std::int32_t>(l.sighting_utime.size());
    m.landmarks.push_back(std::move(l));
  }
  m.nlandmarks = static_cast<std::int32_t>(m.landmarks.size());
  return m;
}

summary_t make_summary(const RunEnd& end, const Config& config) {
  summary_t s{};
  s.utime = end.utime;
  s.final_state = static_cast<std::int8_t>(end.last.state);
  s.scale_state = static_cast<std::int8_t>(end.last.scale);
  s.assumed_scale = config.scale.assumed;
  s.landmark_mode = value_text(config, "landmarks.mode");
  s.frames = end.frames;
  s.frames_valid = end.frames_valid;
  s.reset_counter = static_cast<std::int32_t>(end.last.reset_counter);
  set_counts(end.counts, &s);
  for (std::size_t i = 0; i < end.trajectories.size(); ++i) s.maps.push_back(make_map_summary(end, i));
  s.nmaps = static_cast<std::int32_t>(s.maps.size());
  s.configuration = canonical_text(config);
  return s;
}

double quantile(std::span<const double> sorted, double q) {
  if (sorted.empty()) return kNan;
  const double position = q * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  const double share = position - static_cast<double>(below);
  return sorted[below] + share * (sorted[above] - sorted[below]);
}

}  // namespace farpoint::daemon
