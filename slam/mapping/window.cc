// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/window.h"

#include <algorithm>

namespace farpoint::slam {

namespace {

// All measurements of a landmark are of its one host patch and share its error: noise in its pixels, a
// surface that is not flat. That part does not average out; 1 sigma.
constexpr double kPatchSigma_px = 0.2;
// A landmark without wide parallax is far away or moves: clouds drift by 1 to 2 mrad/s, a car ahead keeps its
// place in the image. A hundred of them look like a slower vehicle: the scale drifted by up to 4 %.
constexpr double kOwnMotion_rad = 0.003;
// A host outside the window counts as this many sightings: a landmark has no place without its host.
constexpr int kHostUses = 1000;

// n measurements of independent error sigma and one common error s have a mean of variance sigma^2 / n + s^2.
// With this weight, n independent measurements have the same.
double shared_error_weight(const BundleProblem& problem, const BundleProblem::Point& point,
                           double shared_sigma_px) {
  double variance_px2 = 0.0;
  for (int i = 0; i < point.measurements; ++i) {
    const int index = point.first_measurement + i;
    const double sigma_px = problem.measurements[static_cast<std::size_t>(index)].sigma_px;
    variance_px2 += sigma_px * sigma_px;
  }
  variance_px2 /= point.measurements;
  return variance_px2 / (variance_px2 + point.measurements * shared_sigma_px * shared_sigma_px);
}

}  // namespace

Window::Window(const EstimatorConfig& config, Map* map, MappingCounts* counts)
    : config_(config), map_(*map), counts_(*counts), pose_index_(map->keyframes().capacity(), -1) {
  problem_.make_room(static_cast<std::size_t>(config.mapping.window_landmarks),
                     static_cast<std::size_t>(config.mapping.window_sightings));
}

void Window::build(KeyframeHandle centre, double further_sigma_factor) {
  further_sigma_factor_ = further_sigma_factor;
  problem_.clear();
  problem_.rig = &map_.rig();
  pose_index_.assign(map_.keyframes().capacity(), -1);
  select_keyframes(centre);
  for (const KeyframeHandle& h : keyframes_) add_pose(h, false);
  select_landmarks();
  fix_observers();
  // A young map has no older observers.
  if (problem_.poses.size() == keyframes_.size()) fix_oldest();
  add_points();
}

void Window::add_pose(KeyframeHandle keyframe, bool fixed) {
  pose_index_[keyframe.index] = static_cast<int>(problem_.poses.size());
  problem_.poses.push_back({map_.keyframes()[keyframe].T_world_body, fixed});
}

void Window::select_keyframes(KeyframeHandle centre) {
  keyframes_.assign(1, centre);
  const auto limit = static_cast<std::size_t>(config_.mapping.window_keyframes);
  for (const Covisible& c : map_.keyframes()[centre].covisible) {
    if (keyframes_.size() >= limit) break;
    keyframes_.push_back(c.keyframe);
  }
}

void Window::select_landmarks() {
  landmarks_.clear();
  is_taken_.assign(map_.landmarks().capacity(), 0);
  for (const KeyframeHandle& h : keyframes_) {
    const Keyframe& k = map_.keyframes()[h];
    for (int c = 0; c < k.views.size(); ++c) select_landmarks_of(k.views[c]);
  }
}

void Window::select_landmarks_of(const KeyframeView& view) {
  for (const LandmarkHandle& lh : view.landmarks) {
    const Landmark* l = map_.landmarks().get(lh);
    // Virtual points stay outside, as in the paper: a common motion of theirs would pass for one of the
    // vehicle. On rendered motorways under drifting clouds they doubled the error.
    if (l == nullptr || l->state == LandmarkState::kBearing || is_taken_[lh.index] != 0) continue;
    if (landmarks_.size() >= static_cast<std::size_t>(config_.mapping.window_landmarks)) return;
    is_taken_[lh.index] = 1;
    landmarks_.push_back(lh);
  }
}

void Window::fix_observers() {
  uses_.assign(map_.keyframes().capacity(), 0);
  for (const LandmarkHandle& lh : landmarks_) {
    const Landmark& l = map_.landmarks()[lh];
    if (pose_index_[l.host.index] < 0) uses_[l.host.index] += kHostUses;
    for (const Observation& o : l.observations)
      if (pose_index_[o.keyframe.index] < 0) ++uses_[o.keyframe.index];
  }
  observers_.clear();
  map_.keyframes().for_each([&](KeyframeHandle h, const Keyframe&) {
    if (uses_[h.index] > 0) observers_.push_back(h);
  });
  std::stable_sort(observers_.begin(), observers_.end(),
                   [&](KeyframeHandle a, KeyframeHandle b) { return uses_[a.index] > uses_[b.index]; });
  const std::size_t count =
      std::min(observers_.size(), static_cast<std::size_t>(config_.mapping.fixed_keyframes));
  for (std::size_t i = 0; i < count; ++i) add_pose(observers_[i], true);
}

void Window::fix_oldest() {
  std::size_t oldest = 0;
  for (std::size_t i = 1; i < keyframes_.size(); ++i)
    if (map_.keyframes()[keyframes_[i]].id < map_.keyframes()[keyframes_[oldest]].id) oldest = i;
  problem_.poses[oldest].fixed = true;
}

void Window::add_points() {
  std::size_t kept = 0;
  for (const LandmarkHandle& lh : landmarks_) {
    const Landmark& l = map_.landmarks()[lh];
    if (pose_index_[l.host.index] < 0) continue;
    if (problem_.measurements.size() + l.observations.size() >
        static_cast<std::size_t>(config_.mapping.window_sightings))
      break;
    const std::size_t points = problem_.points.size();
    add_point(l);
    if (problem_.points.size() > points) landmarks_[kept++] = lh;
  }
  landmarks_.resize(kept);
}

void Window::add_point(const Landmark& l) {
  BundleProblem::Point point;
  point.host = pose_index_[l.host.index];
  point.T_host_anchor = l.T_host_anchor;
  point.bearing = l.bearing;
  point.inverse_depth = l.inverse_depth;
  point.first_measurement = static_cast<int>(problem_.measurements.size());
  for (const Observation& o : l.observations) {
    if (!is_measured(o)) continue;
    BundleProblem::Measurement m;
    m.pose = pose_index_[o.keyframe.index];
    m.camera = o.camera;
    m.pixel = o.pixel.cast<double>();
    m.sigma_px = o.camera == 0 ? o.sigma_px : further_sigma_factor_ * o.sigma_px;
    problem_.measurements.push_back(m);
  }
  point.measurements = static_cast<int>(problem_.measurements.size()) - point.first_measurement;
  if (point.measurements == 0) return;
  const double own_motion_px = kOwnMotion_rad * map_.camera(l.host_camera).camera.focal_px();
  point.weight = shared_error_weight(problem_, point, map_.is_wide(l) ? kPatchSigma_px : own_motion_px);
  problem_.points.push_back(point);
}

std::optional<double> Window::take_back() {
  take_back_poses();
  scale_changes_.clear();
  for (std::size_t i = 0; i < problem_.points.size(); ++i) {
    const BundleProblem::Point& point = problem_.points[i];
    Landmark& l = map_.landmarks()[landmarks_[i]];
    if (l.inverse_depth > 0.0 && point.inverse_depth > 0.0)
      scale_changes_.push_back(point.inverse_depth / l.inverse_depth);
    l.inverse_depth = point.inverse_depth;
    l.inverse_depth_sigma = point.inverse_depth_sigma;
    remove_outliers(landmarks_[i], point);
  }
  if (scale_changes_.empty()) return std::nullopt;
  const auto middle = scale_changes_.begin() + static_cast<std::ptrdiff_t>(scale_changes_.size() / 2);
  std::nth_element(scale_changes_.begin(), middle, scale_changes_.end());
  return *middle;
}

void Window::take_back_poses() {
  for (std::size_t i = 0; i < keyframes_.size(); ++i) {
    if (problem_.poses[i].fixed) continue;
    Keyframe& k = map_.keyframes()[keyframes_[i]];
    k.T_world_body = problem_.poses[i].T_world_body;
    ++k.optimised;
  }
}

void Window::remove_outliers(LandmarkHandle handle, const BundleProblem::Point& point) {
  outliers_.clear();
  int index = point.first_measurement;
  for (const Observation& o : map_.landmarks()[handle].observations) {
    if (!is_measured(o)) continue;
    const auto& m = problem_.measurements[static_cast<std::size_t>(index++)];
    if (m.chi2 > kChi2TwoDof) outliers_.push_back({o.keyframe, o.camera});
  }
  bool alive = true;
  for (const Observer& o : outliers_) alive = alive && map_.remove_observation(handle, o.keyframe, o.camera);
  if (!alive) ++counts_.landmarks_culled;
}

std::vector<Eigen::Matrix<double, 3, 2>> Window::bearing_derivatives(int camera) {
  std::vector<Eigen::Matrix<double, 3, 2>> d_bearing(problem_.points.size(),
                                                     Eigen::Matrix<double, 3, 2>::Zero());
  for (std::size_t i = 0; i < problem_.points.size(); ++i) {
    const Landmark* l = map_.landmarks().get(landmarks_[i]);
    if (l == nullptr)
      problem_.points[i].measurements = 0;
    else if (l->host_camera == camera)
      d_bearing[i] = l->d_bearing_d_pixel;
  }
  return d_bearing;
}

}  // namespace farpoint::slam
