// SPDX-License-Identifier: Apache-2.0
// Which keyframes share landmarks: keeps Keyframe::covisible of all keyframes.
#pragma once

#include <cstddef>
#include <vector>

#include "slam/map/keyframe.h"
#include "slam/map/landmark.h"

namespace farpoint::slam {

struct CovisibilityOptions {
  double wide_parallax_rad = 0.0;  // a landmark with at least this parallax counts as wide
  std::size_t longest_list = 0;    // entries of one keyframe's list; 0: no limit
};

class Covisibility {
 public:
  // Both pools must outlive this object.
  Covisibility(const CovisibilityOptions& options, Pool<Keyframe>* keyframes,
               const Pool<Landmark>& landmarks);

  // Counts the landmarks of state weak and full that this keyframe shares with each other keyframe. Renews
  // its list and its entry in every other list.
  void update(KeyframeHandle handle);
  // Erases the keyframe from every other list. Call before its slot is released. An erased entry is not
  // replaced until the next update() of the list's owner.
  void leave(KeyframeHandle handle);

  // Shows translation: two sightings are at least options.wide_parallax_rad apart.
  [[nodiscard]] bool is_wide(const Landmark& landmark) const {
    return landmark.max_parallax_rad >= options_.wide_parallax_rad;
  }
  // Entries that one list may hold for a moment, for preallocation; 0: no limit.
  [[nodiscard]] std::size_t list_capacity() const {
    return options_.longest_list > 0 ? options_.longest_list + 1
                                     : 0;  // inserted before the weakest is erased
  }

 private:
  struct Shared {
    int all = 0, wide = 0;
  };
  void count_shared(KeyframeHandle handle);
  void count_observers(const Landmark& landmark);
  // Order of a list: most wide landmarks, then most landmarks, then newest.
  [[nodiscard]] bool stronger(const Covisible& a, const Covisible& b) const;

  CovisibilityOptions options_;
  Pool<Keyframe>& keyframes_;
  const Pool<Landmark>& landmarks_;
  // Work space of update().
  std::vector<Shared> shared_;      // one a keyframe slot
  std::vector<Covisible> counted_;  // keyframes that share anything
};

}  // namespace farpoint::slam
