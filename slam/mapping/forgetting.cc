// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/forgetting.h"

#include <algorithm>

namespace farpoint::slam {

namespace {

constexpr double kRedundantShare = 0.9;
constexpr int kOtherObservers = 3;
constexpr std::uint64_t kKeepNewest = 3;

// Of a homogeneous world point; 0 at infinity.
double inverse_distance_from(const Eigen::Vector3d& place_w, const Eigen::Vector4d& point_w) {
  return point_w[3] / std::max((point_w.head<3>() - point_w[3] * place_w).norm(), 1e-9);
}

// Whether enough other keyframes see the landmark at least as finely as level `level` does.
bool seen_by_others(const Landmark& landmark, KeyframeHandle but, int level) {
  int others = 0;
  KeyframeHandle last;  // observations of one keyframe by several cameras lie one behind the other
  for (const Observation& o : landmark.observations) {
    if (o.keyframe == but || o.keyframe == last || o.level > level + 1) continue;
    last = o.keyframe;
    if (++others >= kOtherObservers) return true;
  }
  return false;
}

// Landmarks count by their inverse depth: distant ones are seen by all keyframes around, and would make those
// redundant that alone saw the near ones, which hold the translation.
bool redundant(const Map& map, KeyframeHandle handle) {
  const Keyframe& k = map.keyframes()[handle];
  double all = 0.0, seen_elsewhere = 0.0;
  for (int c = 0; c < k.views.size(); ++c)
    for (const LandmarkHandle& h : k.views[c].landmarks) {
      const Landmark* l = map.landmarks().get(h);
      if (l == nullptr || l->state == LandmarkState::kBearing) continue;
      const Observation& first = *Map::find_observation(*l, handle);
      if (first.camera != c) continue;  // counted with that camera
      const double weight = inverse_distance_from(k.T_world_body.t, map.world_point(*l));
      all += weight;
      if (seen_by_others(*l, handle, first.level)) seen_elsewhere += weight;
    }
  return all > 0.0 && seen_elsewhere > kRedundantShare * all;
}

}  // namespace

void cull_redundant_keyframes(const std::vector<KeyframeHandle>& candidates, std::uint64_t newest_id,
                              Map* map, MappingCounts* counts) {
  for (const KeyframeHandle& h : candidates) {
    if (map->keyframes()[h].id + kKeepNewest > newest_id || !redundant(*map, h)) continue;
    map->remove_keyframe(h);
    ++counts->keyframes_culled;
  }
}

void limit_memory(int images, KeyframeHandle newest, std::uint64_t newest_id, Map* map,
                  MappingCounts* counts) {
  // Pixels, and features without a landmark, stay with the newest keyframes only.
  const auto kept = static_cast<std::uint64_t>(images);
  std::vector<KeyframeHandle> alive;
  map->keyframes().for_each([&](KeyframeHandle h, const Keyframe&) { alive.push_back(h); });
  std::sort(alive.begin(), alive.end(), [map](KeyframeHandle a, KeyframeHandle b) {
    return map->keyframes()[a].id > map->keyframes()[b].id;
  });
  for (std::size_t i = kept; i < alive.size(); ++i) map->thin_keyframe(alive[i]);
  const std::size_t keyframes = map->keyframes().size(), landmarks = map->landmarks().size();
  // A full map forgets its oldest keyframe.
  while (map->keyframes().full() && !alive.empty()) {
    if (alive.back() == newest) break;
    map->remove_keyframe(alive.back());
    alive.pop_back();
  }
  // A full landmark pool: the oldest keyframes' landmarks go with them.
  while (map->landmarks().size() > map->landmarks().capacity() * 9 / 10 && alive.size() > 1) {
    const KeyframeHandle oldest = alive.back();
    for (int c = 0; c < map->keyframes()[oldest].views.size(); ++c) {
      const std::vector<LandmarkHandle> seen = map->keyframes()[oldest].views[c].landmarks;
      for (const LandmarkHandle& h : seen) {
        const Landmark* l = map->landmarks().get(h);
        if (l != nullptr && l->last_seen_keyframe + kept < newest_id)
          map->remove_landmark(h), ++counts->landmarks_culled;
      }
    }
    map->remove_keyframe(oldest);
    alive.pop_back();
  }
  const std::size_t forgotten = keyframes - map->keyframes().size();
  counts->keyframes_culled += forgotten;
  counts->keyframes_forgotten += forgotten;
  counts->landmarks_forgotten += landmarks - map->landmarks().size();
}

}  // namespace farpoint::slam
