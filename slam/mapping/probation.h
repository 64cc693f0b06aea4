// SPDX-License-Identifier: Apache-2.0
// Probation of new landmarks: those that tracking rarely finds, or that no keyframe sees again, are removed.
#pragma once

#include <cstdint>
#include <vector>

#include "slam/map/map.h"
#include "slam/mapping/counts.h"

namespace farpoint::slam {

class Probation {
 public:
  // A landmark that outlives this many keyframes is full.
  static constexpr std::uint64_t kLength_keyframes = 3;
  // Least share of the frames that should show a landmark in which it must be found.
  static constexpr double kMinFoundShare = 0.25;

  // Both must outlive this.
  Probation(Map* map, MappingCounts* counts) : map_(*map), counts_(*counts) {}

  // Forgets all landmarks on probation; they stay in the map.
  void clear() { landmarks_.clear(); }
  // Admits the landmarks with a depth that were made at this keyframe.
  void admit_made_at(KeyframeHandle keyframe);
  // Removes those that fail, and ends the probation of those that have passed.
  void judge(std::uint64_t newest_keyframe_id);

  [[nodiscard]] const std::vector<LandmarkHandle>& landmarks() const { return landmarks_; }

 private:
  [[nodiscard]] static bool fails(const Landmark& landmark, std::uint64_t age_keyframes);

  Map& map_;
  MappingCounts& counts_;
  std::vector<LandmarkHandle> landmarks_;
};

}  // namespace farpoint::slam
