// SPDX-License-Identifier: Apache-2.0
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

KeyframeView preallocated_view(std::size_t features) {
  KeyframeView view;
  preallocate(features, &view.set.features);
  preallocate(features, &view.set.descriptors);
  preallocate(features, &view.landmarks);
  preallocate(features, &view.bearings);
  return view;
}

}  // namespace

KeyframeMemory::KeyframeMemory(const KeyframeMemoryOptions& options)
    : thinned_capacity_(options.features / kThinnedShare) {
  if (options.features == 0) return;
  for (std::size_t i = 0; i < options.with_pixels; ++i)
    spare_views_.push_back(preallocated_view(options.features));
  spare_lists_.resize(options.thinned);
  for (auto& list : spare_lists_) preallocate(thinned_capacity_, &list);
}

KeyframeView KeyframeMemory::take() {
  if (spare_views_.empty()) return {};
  KeyframeView view = std::move(spare_views_.back());
  spare_views_.pop_back();
  return view;
}

void KeyframeMemory::give_back(KeyframeView* view) {
  KeyframeView& spare = spare_views_.emplace_back();
  spare.set = std::move(view->set);
  spare.landmarks = std::move(view->landmarks);
  spare.bearings = std::move(view->bearings);
  spare.grid = std::move(view->grid);
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

std::size_t KeyframeMemory::array_bytes(const KeyframeView& view) {
  return view.set.features.capacity() * sizeof(Feature) +
         view.set.descriptors.capacity() * sizeof(Descriptor) +
         view.landmarks.capacity() * sizeof(LandmarkHandle) +
         view.bearings.capacity() * sizeof(Eigen::Vector3f) + view.grid.bytes();
}

std::size_t KeyframeMemory::bytes() const {
  std::size_t bytes = spare_lists_.size() * thinned_capacity_ * sizeof(LandmarkHandle);
  for (const KeyframeView& spare : spare_views_) bytes += array_bytes(spare);
  return bytes;
}

}  // namespace farpoint::slam
