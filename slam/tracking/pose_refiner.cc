// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/pose_refiner.h"

#include <algorithm>
#include <cmath>

#include "slam/tracking/work_space.h"

namespace farpoint::slam {

namespace {

// Descriptor ratio of the local search, where the window is small.
constexpr float kLocalRatio = 0.8F;

}  // namespace

PoseRefiner::PoseRefiner(const EstimatorConfig& config, Matcher* matcher, int cameras)
    : config_(config.tracking), matcher_(*matcher) {
  const auto features =
      static_cast<std::size_t>(cameras) * static_cast<std::size_t>(config.extractor.features);
  reserve_touched(&measurements_, features);
  reserve_touched(&motions_px_, features);
}

std::size_t PoseRefiner::bytes() const {
  return capacity_bytes(measurements_) + capacity_bytes(motions_px_);
}

PoseSolution PoseRefiner::solve(const SE3& T_world_body_start, const PosePrior& prior) {
  const StageSpan span(listener_, Stage::kPose);
  measurements_.clear();
  const double further_sigma_factor = matcher_.view()->judgement.further_sigma_factor;
  for (const Match& m : matcher_.matches()) {
    const ViewLandmark& l = matcher_.landmark_of(m);
    PoseMeasurement pm;
    pm.point_w = l.point_w;
    pm.anchor_w = l.anchor_w;
    pm.inverse_depth_sigma = l.inverse_depth_sigma;
    pm.pixel = m.pixel.cast<double>();
    pm.sigma_px = m.further ? further_sigma_factor * m.sigma_px : m.sigma_px;
    pm.camera = m.camera;
    measurements_.push_back(pm);
  }
  PoseSolution s = solve_pose(matcher_.view()->rig, prior, T_world_body_start, measurements_);
  for (std::size_t i = 0; i < measurements_.size(); ++i) matcher_.set_inlier(i, measurements_[i].inlier);
  return s;
}

TrackOutcome PoseRefiner::refine(const Frame& frame, const SE3& T_world_body_start, const PosePrior& prior) {
  TrackOutcome out;
  out.T_world_body = T_world_body_start;
  matcher_.drop_outliers();
  matcher_.project(frame, T_world_body_start, LandmarkSubset::kAll);
  out.expected = static_cast<int>(matcher_.candidates().size());
  matcher_.match(frame, config_.local_search_px, kLocalRatio);
  matcher_.align(frame);
  out.matches = static_cast<int>(matcher_.matches().size());
  if (out.matches < config_.min_matches / 2) return out;
  matcher_.measure_further(frame, T_world_body_start);
  const PoseSolution s = solve(T_world_body_start, prior);
  out.T_world_body = s.T_world_body;
  out.covariance = s.covariance;
  out.inliers = s.inliers - further_inliers();
  out.rms = s.rms;
  count_inliers(&out);
  out.ok = s.ok && s.inliers >= config_.min_inliers / 2;
  if (out.ok) out.median_motion_px = motion_since_reference_px(s.T_world_body);
  return out;
}

// A landmark counts once, however many cameras measure it.
int PoseRefiner::further_inliers() const {
  const auto& matches = matcher_.matches();
  return static_cast<int>(
      std::count_if(matches.begin(), matches.end(), [](const Match& m) { return m.further && m.inlier; }));
}

void PoseRefiner::count_inliers(TrackOutcome* outcome) const {
  for (const Match& m : matcher_.matches()) {
    if (m.further) continue;
    const ViewLandmark& l = matcher_.landmark_of(m);
    if (l.confirmed) ++outcome->confirmed_matches;
    if (!m.inlier) continue;
    if (m.aligned) ++outcome->aligned;
    if (l.confirmed) ++outcome->confirmed_inliers;
    if (!l.in_reference || !l.confirmed) continue;
    ++outcome->reference_inliers;
    outcome->reference_nearness += l.nearness;
  }
}

void PoseRefiner::add_motions_of(int index, const SE3& T_world_body) {
  const RigCamera& camera = matcher_.camera(index);
  const Eigen::Vector3d centre = (T_world_body * camera.T_body_camera).t;
  const Eigen::Vector3d reference = (matcher_.view()->T_world_reference * camera.T_body_camera).t;
  for (const Match& m : matcher_.matches()) {
    const ViewLandmark& l = matcher_.landmark_of(m);
    if (m.camera != index || !m.inlier || !l.confirmed) continue;
    const Eigen::Vector4d& p = l.point_w;
    const Eigen::Vector3d now = p.head<3>() - p[3] * centre, then = p.head<3>() - p[3] * reference;
    motions_px_.push_back(std::atan2(now.cross(then).norm(), now.dot(then)) * camera.camera.focal_px());
  }
}

// Median parallax: where landmarks are now against where rotation alone would have put them.
double PoseRefiner::motion_since_reference_px(const SE3& T_world_body) {
  motions_px_.clear();
  const auto cameras = static_cast<int>(matcher_.view()->rig.cameras.size());
  for (int c = 0; c < cameras; ++c) add_motions_of(c, T_world_body);
  if (motions_px_.empty()) return 0.0;
  const auto middle = motions_px_.begin() + static_cast<std::ptrdiff_t>(motions_px_.size() / 2);
  std::nth_element(motions_px_.begin(), middle, motions_px_.end());
  return *middle;
}

}  // namespace farpoint::slam
