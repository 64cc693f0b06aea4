#include "slam/map/covisibility.h"

#include <algorithm>

namespace farpoint::slam {

Covisibility::Covisibility(const CovisibilityOptions& options, Pool<Keyframe>* keyframes,
                           const Pool<Landmark>& landmarks)
    : options_(options), keyframes_(*keyframes), landmarks_(landmarks), shared_(keyframes->capacity()) {}

bool Covisibility::stronger(const Covisible& a, const Covisible& b) const {
  if (a.wide != b.wide) return a.wide > b.wide;
  if (a.shared != b.shared) return a.shared > b.shared;
  return keyframes_[a.keyframe].id > keyframes_[b.keyframe].id;
}

void Covisibility::count_shared(const Keyframe& keyframe) {
  std::fill(shared_.begin(), shared_.end(), Shared{});
  for (const LandmarkHandle& handle : keyframe.landmarks) {
    const Landmark* l = landmarks_.get(handle);
    if (l == nullptr || l->state == LandmarkState::kBearing) continue;
    const int wide = is_wide(*l) ? 1 : 0;
    for (const Observation& o : l->observations) {
      ++shared_[o.keyframe.index].all;
      shared_[o.keyframe.index].wide += wide;
    }
  }
}

void Covisibility::update(KeyframeHandle handle) {
  Keyframe& keyframe = keyframes_[handle];
  const std::size_t longest = options_.longest_list > 0 ? options_.longest_list : keyframes_.capacity();
  count_shared(keyframe);
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
