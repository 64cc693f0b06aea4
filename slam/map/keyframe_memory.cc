#include "slam/map/keyframe_memory.h"

#include <algorithm>
#include <utility>

namespace farpoint::slam {

namespace {

// Capacities of longer lists are multiples of this, so that the heap can use a freed one again.
constexpr std::size_t kLongListStep = 128;

// Touched, not only reserved: first use of a page on the road would be a page fault on the road.
template <typename T>
void preallocate(std::size_t size, std::vector<T>* array) {
  array->resize(size);
  array->clear();
}

Keyframe preallocated_keyframe(std::size_t features) {
  Keyframe keyframe;
  preallocate(features, &keyframe.set.features);
  preallocate(features, &keyframe.set.descriptors);
  preallocate(features, &keyframe.landmarks);
  preallocate(features, &keyframe.bearings);
  return keyframe;
}

}  // namespace

KeyframeMemory::KeyframeMemory(const KeyframeMemoryOptions& options)
    : thinned_capacity_(options.features / kThinnedShare) {
  if (options.features == 0) return;
  for (std::size_t i = 0; i < options.with_pixels; ++i)
    spare_keyframes_.push_back(preallocated_keyframe(options.features));
  spare_lists_.resize(options.thinned);
  for (auto& list : spare_lists_) preallocate(thinned_capacity_, &list);
}

Keyframe KeyframeMemory::take() {
  if (spare_keyframes_.empty()) return {};
  Keyframe keyframe = std::move(spare_keyframes_.back());
  spare_keyframes_.pop_back();
  return keyframe;
}

void KeyframeMemory::give_back(Keyframe* keyframe) {
  Keyframe& spare = spare_keyframes_.emplace_back();
  spare.set = std::move(keyframe->set);
  spare.landmarks = std::move(keyframe->landmarks);
  spare.bearings = std::move(keyframe->bearings);
  spare.grid = std::move(keyframe->grid);
}

std::vector<LandmarkHandle> KeyframeMemory::take_thinned(std::size_t landmarks) {
  std::vector<LandmarkHandle> list;
  if (landmarks <= thinned_capacity_ && !spare_lists_.empty()) {
    list = std::move(spare_lists_.back());
    spare_lists_.pop_back();
    list.clear();
  } else {
    list.reserve((landmarks + kLongListStep - 1) / kLongListStep * kLongListStep);
  }
  return list;
}

void KeyframeMemory::give_back_thinned(std::vector<LandmarkHandle>&& landmarks) {
  // A longer list is rare and goes back to the heap: kept, all lists would grow to the longest in time.
  if (thinned_capacity_ > 0 && landmarks.capacity() == thinned_capacity_)
    spare_lists_.push_back(std::move(landmarks));
}

std::size_t KeyframeMemory::array_bytes(const Keyframe& k) {
  return k.set.features.capacity() * sizeof(Feature) + k.set.descriptors.capacity() * sizeof(Descriptor) +
         k.landmarks.capacity() * sizeof(LandmarkHandle) + k.bearings.capacity() * sizeof(Eigen::Vector3f) +
         k.grid.bytes();
}

std::size_t KeyframeMemory::bytes() const {
  std::size_t bytes = spare_lists_.size() * thinned_capacity_ * sizeof(LandmarkHandle);
  for (const Keyframe& spare : spare_keyframes_) bytes += array_bytes(spare);
  return bytes;
}

}  // namespace farpoint::slam
