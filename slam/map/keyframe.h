// SPDX-License-Identifier: Apache-2.0
// A keyframe: a frame that the map keeps.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "slam/image/feature_grid.h"
#include "slam/map/landmark.h"
#include "slam/map/per_camera.h"

namespace farpoint::slam {

struct Covisible {
  KeyframeHandle keyframe;
  int shared = 0;  // landmarks seen by both
  int wide = 0;    // of these, seen under an angle that shows translation
};

// What one camera showed. Empty where that camera gave no image.
struct KeyframeView {
  std::vector<LandmarkHandle> landmarks;  // one a feature; null: none. Thinned: one an observation
  // For the search for new landmarks, while the keyframe is recent (CapacityConfig::window_images):
  FeatureSet set;
  std::vector<Eigen::Vector3f> bearings;  // unit, camera axes; one a feature
  FeatureGrid grid;
  std::shared_ptr<const FrameImage> image;  // pixels for alignment; null: thinned, or no image

  [[nodiscard]] bool has_pixels() const { return image != nullptr; }
  // It has corners of its own, by which landmarks can be found. Else its features are places where a further
  // camera shows those of the first.
  [[nodiscard]] bool has_corners() const { return !set.descriptors.empty(); }
};

struct Keyframe {
  std::uint64_t id = 0;  // ascending over the whole run
  std::int64_t utime = 0;
  std::uint64_t frame_number = 0;
  std::int32_t map_id = 0;
  std::uint32_t optimised = 0;  // times local BA moved it
  SE3 T_world_body;
  double scale = 1.0;  // present map units in one of its own: those of the map when it was made
  PerCamera<KeyframeView> views;

  // Most wide ones first: keyframes that share only distant landmarks say little about each other's place.
  // Then most shared, then newest.
  std::vector<Covisible> covisible;

  // Maps body coordinates in the keyframe's own unit to the world. A pose relative to the keyframe, in that
  // unit, follows it through every change of the map's unit.
  [[nodiscard]] Sim3 S_world_body() const { return {scale, T_world_body.q, T_world_body.t}; }
  // Some camera's pixels are still there.
  [[nodiscard]] bool has_pixels() const {
    for (int c = 0; c < views.size(); ++c)
      if (views[c].has_pixels()) return true;
    return false;
  }
};

}  // namespace farpoint::slam
