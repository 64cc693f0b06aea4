// A remembered frame.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "slam/image/feature_grid.h"
#include "slam/map/landmark.h"

namespace farpoint::slam {

struct Covisible {
  KeyframeHandle keyframe;
  int shared = 0;  // landmarks seen by both
  int wide = 0;    // of these, seen under an angle that shows translation
};

struct Keyframe {
  std::uint64_t id = 0;  // ascending over the whole run
  std::int32_t map_id = 0;
  std::int64_t utime = 0;
  std::uint64_t frame_number = 0;
  int camera = 0;
  SE3 T_world_body;

  std::vector<LandmarkHandle> landmarks;  // one a feature; null: none. Thinned: one an observation
  // For the search for new landmarks, while the keyframe is recent (CapacityConfig::window_images):
  FeatureSet set;
  std::vector<Eigen::Vector3f> bearings;  // unit, camera axes; one a feature
  FeatureGrid grid;
  std::shared_ptr<const FrameImage> image;  // pixels for alignment

  // Most wide ones first: keyframes that share only what is far say little about each other's place. Then
  // most shared, then newest.
  std::vector<Covisible> covisible;
  std::uint64_t optimised = 0;  // times local BA moved it
};

}  // namespace farpoint::slam
