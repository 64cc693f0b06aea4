// SPDX-License-Identifier: Apache-2.0
// Depth from the rig: where the further cameras of a keyframe show what its first camera shows. The baseline
// between two cameras gives parallax as motion does, by the same landmarks, thresholds and states; it has a
// known length, so that the map is metric.
#pragma once

#include <cstddef>

#include "slam/config.h"
#include "slam/image/curve_search.h"
#include "slam/map/map.h"
#include "slam/mapping/counts.h"
#include "slam/mapping/landmark_maker.h"

namespace farpoint::slam {

class RigDepth {
 public:
  // All must outlive this.
  RigDepth(const EstimatorConfig& config, Map* map, LandmarkMaker* maker, MappingCounts* counts)
      : config_(config), map_(*map), maker_(*maker), counts_(*counts) {}

  // For each feature of camera 0: measures its landmark in the further cameras that do not show it yet, and
  // makes a landmark where there is none. Cameras without an image, or with corners of their own, are left
  // out.
  void measure(KeyframeHandle keyframe);

 private:
  void measure_by(KeyframeHandle keyframe, int camera);
  [[nodiscard]] bool add_sighting(LandmarkHandle handle, KeyframeHandle keyframe, int camera,
                                  std::size_t feature);
  [[nodiscard]] double nearest_inverse_depth(int camera) const;

  const EstimatorConfig& config_;
  Map& map_;
  LandmarkMaker& maker_;
  MappingCounts& counts_;
};

}  // namespace farpoint::slam
