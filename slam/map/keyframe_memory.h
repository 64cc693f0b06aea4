// SPDX-License-Identifier: Apache-2.0
// Memory of the arrays of keyframes' views: allocated and touched at the start, used again by later
// keyframes.
#pragma once

#include <cstddef>
#include <vector>

#include "slam/map/keyframe.h"

namespace farpoint::slam {

struct KeyframeMemoryOptions {
  std::size_t features = 0;     // most of one view; 0: nothing is preallocated
  std::size_t with_pixels = 0;  // views that keep their features at once
  std::size_t thinned = 0;      // views that keep a list of landmarks only
};

// Without it a long run would fragment the heap.
class KeyframeMemory {
 public:
  // A thinned view keeps a sixth to a third of its features: the corners of landmarks.
  static constexpr std::size_t kThinnedShare = 3;

  explicit KeyframeMemory(const KeyframeMemoryOptions& options);

  // A view to be filled. Its arrays have capacity and arbitrary contents. Empty arrays where all preallocated
  // ones are in use.
  [[nodiscard]] KeyframeView take();
  // Takes back the features, landmarks, bearings and grid of a view that keeps its pixels no longer.
  void give_back(KeyframeView* view);

  // An empty list with capacity for the landmarks of a thinned view.
  [[nodiscard]] std::vector<LandmarkHandle> take_thinned(std::size_t landmarks);
  void give_back_thinned(std::vector<LandmarkHandle>&& landmarks);

  // Heap memory of the arrays of one view.
  [[nodiscard]] static std::size_t array_bytes(const KeyframeView& view);
  // Heap memory of the spare arrays.
  [[nodiscard]] std::size_t bytes() const;

 private:
  std::vector<KeyframeView> spare_views_;
  std::size_t thinned_capacity_;  // of one list in:
  std::vector<std::vector<LandmarkHandle>> spare_lists_;
};

}  // namespace farpoint::slam
