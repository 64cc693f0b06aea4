// SPDX-License-Identifier: Apache-2.0
#include "slam/map/covisibility.h"

#include <algorithm>

namespace farpoint::slam {

namespace {

// The first camera of the keyframe that sees the landmark. Precondition: one does.
int first_camera_of(const Landmark& landmark, KeyframeHandle keyframe) {
  const auto first = std::find_if(landmark.observations.begin(), landmark.observations.end(),
                                  [&](const Observation& o) { return o.keyframe == keyframe; });
  return first->camera;
}

}  // namespace

Covisibility::Covisibility(const CovisibilityOptions& options, Pool<Keyframe>* keyframes,
                           const Pool<Landmark>& landmarks)
    : options_(options), keyframes_(*keyframes), landmarks_(landmarks), shared_(keyframes->capacity()) {}

bool Covisibility::stronger(const Covisible& a, const Covisible& b) const {
  if (a.wide != b.wide) return a.wide > b.wide;
  if (a.shared != b.shared) return a.shared > b.shared;
  return keyframes_[a.keyframe].id > keyframes_[b.keyframe].id;
}

void Covisibility::count_shared(KeyframeHandle handle) {
  const Keyframe& keyframe = keyframes_[handle];
  std::fill(shared_.begin(), shared_.end(), Shared{});
  for (int c = 0; c < keyframe.views.size(); ++c)
    for (const LandmarkHandle& seen : keyframe.views[c].landmarks) {
      const Landmark* l = landmarks_.get(seen);
      if (l == nullptr || l->state == LandmarkState::kBearing) continue;
      if (c > 0 && first_camera_of(*l, handle) < c) continue;  // counted with that camera
      count_observers(*l);
    }
}

// Observations of one keyframe by several cameras lie one behind the other, and count once.
void Covisibility::count_observers(const Landmark& landmark) {
  const int wide = is_wide(landmark) ? 1 : 0;
  KeyframeHandle last;
  for (const Observation& o : landmark.observations) {
    if (o.keyframe == last) continue;
    last = o.keyframe;
    ++shared_[o.keyframe.index].all;
    shared_[o.keyframe.index].wide += wide;
  }
}

void Covisibility::update(KeyframeHandle handle) {
  Keyframe& keyframe = keyframes_[handle];
  const std::size_t longest = options_.longest_list > 0 ? options_.longest_list : keyframes_.capacity();
  count_shared(handle);
  leave(handle);
  const auto order = [this](const Covisible& a, const Covisible& b) { return stronger(a, b); };
  // A list of its own: the keyframe's list would keep capacity for all that share anything.
  counted_.clear();
  keyframes_.for_each([&](KeyframeHandle h, Keyframe& other) {
    const Shared& shared = shared_[h.index];
    if (h == handle || shared.all == 0) return;
    counted_.push_back({h, shared.all, shared.wide});
    const Covisible back{handle, shared.all, shared.wide};
    other.covisible.insert(std::lower_bound(other.covisible.begin(), other.covisible.end(), back, order),
                           back);
    if (other.covisible.size() > longest) other.covisible.pop_back();
  });
  std::sort(counted_.begin(), counted_.end(), order);
  const auto kept = static_cast<std::ptrdiff_t>(std::min(longest, counted_.size()));
  keyframe.covisible.assign(counted_.begin(), counted_.begin() + kept);
}

// All lists are searched: a full list of stronger entries may lack the owner of a list that it is in.
void Covisibility::leave(KeyframeHandle handle) {
  keyframes_.for_each([&](KeyframeHandle, Keyframe& other) {
    std::erase_if(other.covisible, [&](const Covisible& o) { return o.keyframe == handle; });
  });
}

}  // namespace farpoint::slam
