// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/view_builder.h"

#include <algorithm>

#include "slam/mapping/neighbours.h"

namespace farpoint::slam {

namespace {

std::shared_ptr<LocalView> preallocated_view(const EstimatorConfig& config) {
  auto view = std::make_shared<LocalView>();
  view->landmarks.resize(static_cast<std::size_t>(config.capacity.view_landmarks));
  view->keyframes.resize(ViewBuilder::kMaxKeyframes);
  view->landmarks.clear();
  view->keyframes.clear();
  return view;
}

}  // namespace

ViewBuilder::ViewBuilder(const EstimatorConfig& config, const Map* map)
    : config_(config),
      map_(*map),
      views_(kViews, [&config] { return preallocated_view(config); }),
      anchors_(map->keyframes().capacity()) {}

std::size_t ViewBuilder::bytes() const {
  const LocalView& view = views_.sample();
  return views_.capacity() * (sizeof(LocalView) + view.landmarks.capacity() * sizeof(ViewLandmark) +
                              view.keyframes.capacity() * sizeof(ViewKeyframe));
}

bool ViewBuilder::guides_tracking(const Landmark& landmark) const {
  // Tracking takes a virtual point's inverse depth with its sigma (the residual's covariance): it holds the
  // rotation. (ours; the paper uses virtual points once they are points.) Two sightings agree with any
  // mismatch along the line.
  if (landmark.state != LandmarkState::kBearing) return true;
  return landmark.failures == 0 &&
         static_cast<int>(landmark.observations.size()) >= config_.landmarks.bearing_observations;
}

std::shared_ptr<const LocalView> ViewBuilder::build(KeyframeHandle reference, const MapJudgement& judgement) {
  const std::shared_ptr<LocalView> view = views_.take();
  if (!view) return view;
  begin(reference, judgement, view.get());
  select_keyframes(reference);
  is_taken_.assign(map_.landmarks().capacity(), 0);
  depths_.clear();
  anchors_.forget();
  for (const KeyframeHandle& h : keyframes_) {
    const Keyframe& k = map_.keyframes()[h];
    view->keyframes.push_back({k.id, k.T_world_body, k.scale});
    add_landmarks(h, h == reference, view.get());
  }
  std::sort(view->keyframes.begin(), view->keyframes.end(),
            [](const ViewKeyframe& a, const ViewKeyframe& b) { return a.id < b.id; });
  if (!depths_.empty()) view->median_depth = median_depth();
  return view;
}

void ViewBuilder::begin(KeyframeHandle reference, const MapJudgement& judgement, LocalView* view) {
  const Keyframe& centre = map_.keyframes()[reference];
  view->keyframes.clear();
  view->landmarks.clear();
  view->reference_landmarks = 0;
  view->reference_nearness = 0.0;
  view->median_depth = LocalView{}.median_depth;
  view->sequence = ++sequence_;
  view->map_id = centre.map_id;
  view->reference_id = centre.id;
  view->T_world_reference = centre.T_world_body;
  view->reference_scale = centre.scale;
  view->judgement = judgement;
  view->rig = map_.rig();
  view->map_keyframes = 0;
  map_.keyframes().for_each(
      [&](KeyframeHandle, const Keyframe& k) { view->map_keyframes += k.map_id == centre.map_id; });
}

void ViewBuilder::add_keyframe(KeyframeHandle keyframe) {
  if (is_member_[keyframe.index] != 0) return;
  is_member_[keyframe.index] = 1;
  keyframes_.push_back(keyframe);
}

void ViewBuilder::select_keyframes(KeyframeHandle reference) {
  keyframes_.clear();
  is_member_.assign(map_.keyframes().capacity(), 0);
  add_keyframe(reference);
  for (const KeyframeHandle& h : neighbours_of(map_, reference, kNeighbours)) add_keyframe(h);
  // The second ring holds what the vehicle saw before a turn, and sees again after it.
  for (std::size_t i = 1, n = std::min(keyframes_.size(), kSecondRing); i < n; ++i)
    for (const KeyframeHandle& h : neighbours_of(map_, keyframes_[i], kSecondNeighbours)) add_keyframe(h);
}

void ViewBuilder::add_landmarks(KeyframeHandle keyframe, bool is_reference, LocalView* view) {
  const Keyframe& k = map_.keyframes()[keyframe];
  for (int c = 0; c < k.views.size(); ++c) {
    if (is_reference) T_reference_world_ = map_.T_world_camera(k, c).inverse();
    add_landmarks_of(k.views[c], is_reference, view);
  }
}

void ViewBuilder::add_landmarks_of(const KeyframeView& keyframe_view, bool is_reference, LocalView* view) {
  for (const LandmarkHandle& lh : keyframe_view.landmarks) {
    const Landmark* l = map_.landmarks().get(lh);
    if (l == nullptr || !guides_tracking(*l) || is_taken_[lh.index] != 0) continue;
    // The most covisible keyframes come first: a full view lacks the landmarks of the least covisible ones.
    if (view->landmarks.size() == static_cast<std::size_t>(config_.capacity.view_landmarks)) break;
    is_taken_[lh.index] = 1;
    ViewLandmark v = make_landmark(lh, *l);
    v.in_reference = is_reference;
    if (is_reference) measure_in_reference(&v, view);
    view->landmarks.push_back(v);
  }
}

ViewLandmark ViewBuilder::make_landmark(LandmarkHandle handle, const Landmark& l) {
  ViewLandmark v;
  v.handle = handle;
  const PredictionInput in = anchors_.prediction_input(map_, l);
  v.point_w = in.point_w;
  v.anchor_w = in.anchor_w;
  v.d_point_d_pixel = in.d_point_d_pixel;
  v.inverse_depth_sigma = l.inverse_depth_sigma;
  v.descriptor = l.descriptor;
  v.patch = l.patch;
  v.host_level = l.host_level;
  v.found_share = static_cast<float>(l.found) / static_cast<float>(std::max(l.visible, 1U));
  v.confirmed =
      l.state == LandmarkState::kFull || (l.state == LandmarkState::kWeak && l.observations.size() > 2);
  return v;
}

void ViewBuilder::measure_in_reference(ViewLandmark* v, LocalView* view) {
  const double d =
      (T_reference_world_.q * v->point_w.head<3>() + v->point_w[3] * T_reference_world_.t).norm();
  v->nearness = v->point_w[3] / std::max(d, 1e-9);
  if (v->confirmed) {
    ++view->reference_landmarks;
    view->reference_nearness += v->nearness;
  }
  depths_.push_back(d / std::max(v->point_w[3], 1e-9));
}

double ViewBuilder::median_depth() {
  const auto middle = depths_.begin() + static_cast<std::ptrdiff_t>(depths_.size() / 2);
  std::nth_element(depths_.begin(), middle, depths_.end());
  return *middle;
}

}  // namespace farpoint::slam
