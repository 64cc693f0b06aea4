// SPDX-License-Identifier: Apache-2.0
// How often each landmark should have been, and was, seen since the last keyframe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "slam/map/request.h"

namespace farpoint::slam {

// Tracking's thread; makes no heap call after construction, except into the vector given to take().
class SightingCounter {
 public:
  // `landmarks`: slots of the map's pool.
  explicit SightingCounter(std::size_t landmarks);

  // The landmark projected into the image.
  void add_visible(LandmarkHandle landmark) { ++count_of(landmark).visible; }
  // The landmark is an inlier of an accepted pose.
  void add_found(LandmarkHandle landmark) { ++count_of(landmark).found; }
  // Moves the counts out, in the order in which their landmarks were first counted.
  void take(std::vector<SightingCount>* out);
  void clear();

  [[nodiscard]] std::size_t bytes() const;

 private:
  // A landmark that took over the slot of a removed one begins at zero.
  [[nodiscard]] SightingCount& count_of(LandmarkHandle landmark) {
    SightingCount& c = counts_[landmark.index];
    if (c.landmark != landmark) {
      if (c.landmark.is_null()) counted_slots_.push_back(landmark.index);
      c = {landmark, 0, 0};
    }
    return c;
  }

  std::vector<SightingCount> counts_;  // one a landmark slot of the map
  std::vector<std::uint32_t> counted_slots_;
};

}  // namespace farpoint::slam
