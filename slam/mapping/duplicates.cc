// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/duplicates.h"

#include <cmath>

#include "slam/image/descriptor_search.h"
#include "slam/map/predict.h"
#include "slam/mapping/neighbours.h"

namespace farpoint::slam {

Duplicates::Duplicates(const EstimatorConfig& config, Map* map, MappingCounts* counts)
    : config_(config), map_(*map), counts_(*counts), anchors_(map->keyframes().capacity()) {}

std::vector<KeyframeHandle> Duplicates::neighbours(KeyframeHandle keyframe) const {
  return neighbours_of(map_, keyframe, static_cast<std::size_t>(config_.mapping.neighbours));
}

void Duplicates::fuse(LandmarkHandle into, LandmarkHandle from) {
  const auto theirs = map_.landmarks()[from].observations;
  const std::uint32_t found = map_.landmarks()[from].found, visible = map_.landmarks()[from].visible;
  map_.remove_landmark(from);
  Landmark& l = map_.landmarks()[into];
  for (const Observation& o : theirs) {
    Observation measured;
    if (Map::find_observation(l, o.keyframe, o.camera) == nullptr &&
        measure_observation(config_, map_, l, o.keyframe, o.camera, static_cast<std::size_t>(o.feature),
                            &measured))
      map_.add_observation(into, measured);
  }
  l.found += found;
  l.visible += visible;
  ++counts_.landmarks_fused;
}

int Duplicates::find_feature(const KeyframeView& view, const Predictor& predictor, const Landmark& landmark) {
  Prediction p;
  if (!predictor.predict(anchors_.prediction_input(map_, landmark), 4.0, &p) || !is_matchable(p)) return -1;
  const double scale_factor = config_.pyramid.scale_factor;
  const int level = predicted_level(landmark.host_level, p.scale_change, static_cast<float>(scale_factor),
                                    config_.pyramid.levels);
  DescriptorQuery q;
  q.descriptor = landmark.descriptor;
  q.u_px = static_cast<float>(p.pixel.x());
  q.v_px = static_cast<float>(p.pixel.y());
  q.radius_px = static_cast<float>(3.0 * std::pow(scale_factor, level));
  q.min_level = level - 1;
  q.max_level = level + 1;
  q.max_hamming = config_.tracking.max_hamming * 3 / 4;
  q.ratio = 1.0F;
  return find_descriptor(view.set, view.grid, q, [](std::size_t) { return true; });
}

void Duplicates::join(LandmarkHandle landmark, Observer observer, std::size_t feature) {
  const Landmark& l = map_.landmarks()[landmark];
  const LandmarkHandle owner = map_.keyframes()[observer.keyframe].views[observer.camera].landmarks[feature];
  const Landmark* other = map_.landmarks().get(owner);
  if (other != nullptr && other->state != LandmarkState::kBearing) {
    if (other->observations.size() > l.observations.size())
      fuse(owner, landmark);
    else
      fuse(landmark, owner);
    return;
  }
  Observation o;
  if (!measure_observation(config_, map_, l, observer.keyframe, observer.camera, feature, &o)) return;
  if (other != nullptr) map_.remove_landmark(owner);
  map_.add_observation(landmark, o);
}

void Duplicates::search_into(KeyframeHandle handle, const std::vector<LandmarkHandle>& landmarks) {
  for (int c = 0; c < map_.keyframes()[handle].views.size(); ++c) search_into_view({handle, c}, landmarks);
}

void Duplicates::search_into_view(Observer observer, const std::vector<LandmarkHandle>& landmarks) {
  const Keyframe& keyframe = map_.keyframes()[observer.keyframe];
  const KeyframeView& view = keyframe.views[observer.camera];
  if (!view.has_pixels() || !view.has_corners()) return;
  const Predictor predictor(map_.camera(observer.camera).camera,
                            map_.T_world_camera(keyframe, observer.camera).inverse());
  anchors_.forget();
  for (const LandmarkHandle& lh : landmarks) {
    const Landmark* l = map_.landmarks().get(lh);
    if (l == nullptr || l->state == LandmarkState::kBearing ||
        Map::find_observation(*l, observer.keyframe, observer.camera) != nullptr)
      continue;
    const int feature = find_feature(view, predictor, *l);
    if (feature >= 0) join(lh, observer, static_cast<std::size_t>(feature));
  }
}

void Duplicates::fuse_neighbourhood(KeyframeHandle handle) {
  const Keyframe& keyframe = map_.keyframes()[handle];
  own_ = keyframe.views[0].landmarks;
  for (int c = 1; c < keyframe.views.size(); ++c)
    own_.insert(own_.end(), keyframe.views[c].landmarks.begin(), keyframe.views[c].landmarks.end());
  for (const KeyframeHandle& n : neighbours(handle)) search_into(n, own_);
  search_neighbours_landmarks(handle);
}

void Duplicates::search_neighbours_landmarks(KeyframeHandle keyframe) {
  theirs_.clear();
  taken_.assign(map_.landmarks().capacity(), 0);
  for (const KeyframeHandle& n : neighbours(keyframe)) take_landmarks(map_.keyframes()[n]);
  search_into(keyframe, theirs_);
}

void Duplicates::take_landmarks(const Keyframe& keyframe) {
  for (int c = 0; c < keyframe.views.size(); ++c)
    for (const LandmarkHandle& h : keyframe.views[c].landmarks)
      // A landmark already taken costs no look at its slot, which lies far away in memory.
      if (!h.is_null() && taken_[h.index] == 0 && map_.landmarks().contains(h)) {
        taken_[h.index] = 1;
        theirs_.push_back(h);
      }
}

}  // namespace farpoint::slam
