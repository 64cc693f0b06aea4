// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/probation.h"

#include <algorithm>

namespace farpoint::slam {

void Probation::admit_made_at(KeyframeHandle keyframe) {
  const Keyframe& k = map_.keyframes()[keyframe];
  for (int c = 0; c < k.views.size(); ++c) {
    if (!k.views[c].has_corners()) continue;  // the first camera's landmarks once more
    for (const LandmarkHandle& h : k.views[c].landmarks) {
      const Landmark* l = map_.landmarks().get(h);
      if (l != nullptr && l->state != LandmarkState::kBearing && l->created_keyframe == k.id)
        landmarks_.push_back(h);
    }
  }
}

bool Probation::fails(const Landmark& landmark, std::uint64_t age_keyframes) {
  const bool rarely_found = landmark.found < kMinFoundShare * landmark.visible;
  const bool never_seen_again = age_keyframes >= 2 && landmark.observations.size() <= 2;
  return rarely_found || never_seen_again;
}

void Probation::judge(std::uint64_t newest_keyframe_id) {
  std::vector<LandmarkHandle> keep;
  for (const LandmarkHandle& h : landmarks_) {
    Landmark* l = map_.landmarks().get(h);
    if (l == nullptr || l->state == LandmarkState::kBearing) continue;
    const std::uint64_t age = newest_keyframe_id - std::min(newest_keyframe_id, l->created_keyframe);
    if (fails(*l, age)) {
      map_.remove_landmark(h);
      ++counts_.landmarks_culled;
    } else if (age < kLength_keyframes) {
      keep.push_back(h);
    } else {
      l->state = LandmarkState::kFull;
    }
  }
  landmarks_.swap(keep);
}

}  // namespace farpoint::slam
