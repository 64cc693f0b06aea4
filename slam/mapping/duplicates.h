// SPDX-License-Identifier: Apache-2.0
// Duplicates: landmarks of one keyframe are searched in another; two landmarks on one corner are fused.
#pragma once

#include <cstdint>
#include <vector>

#include "slam/config.h"
#include "slam/map/map.h"
#include "slam/mapping/counts.h"
#include "slam/mapping/measurement.h"

namespace farpoint::slam {

class Duplicates {
 public:
  // All three must outlive this.
  Duplicates(const EstimatorConfig& config, Map* map, MappingCounts* counts);

  // Searches the neighbours' landmarks in the keyframe.
  void search_neighbours_landmarks(KeyframeHandle keyframe);
  // The same, after searching the keyframe's landmarks in each neighbour.
  void fuse_neighbourhood(KeyframeHandle handle);

  // Adds a sighting where a landmark's patch is found on a free corner. A taken corner fuses both landmarks:
  // the one with more sightings stays, and a virtual point is removed. Skips thinned keyframes.
  void search_into(KeyframeHandle handle, const std::vector<LandmarkHandle>& landmarks);
  // Measures the sightings of `from` anew with the patch of `into`, adds them where the keyframe does not see
  // `into`, and removes `from`. Precondition: both are alive and differ.
  void fuse(LandmarkHandle into, LandmarkHandle from);

 private:
  [[nodiscard]] std::vector<KeyframeHandle> neighbours(KeyframeHandle keyframe) const;
  // Index of the view's feature that shows the landmark; -1 where there is none.
  [[nodiscard]] int find_feature(const KeyframeView& view, const Predictor& predictor,
                                 const Landmark& landmark);
  void take_landmarks(const Keyframe& keyframe);
  void search_into_view(Observer observer, const std::vector<LandmarkHandle>& landmarks);
  void join(LandmarkHandle landmark, Observer observer, std::size_t feature);

  const EstimatorConfig& config_;
  Map& map_;
  MappingCounts& counts_;
  // Work space.
  AnchorMemory anchors_;
  std::vector<LandmarkHandle> own_, theirs_;
  std::vector<std::uint8_t> taken_;  // by landmark slot
};

}  // namespace farpoint::slam
