// SPDX-License-Identifier: Apache-2.0
// What tracking hands to mapping: sightings, keyframe requests, the pair that a map starts from.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "slam/geometry/se3.h"
#include "slam/map/frame.h"
#include "slam/map/landmark.h"

namespace farpoint::slam {

// A landmark found in a frame.
struct Sighting {
  LandmarkHandle landmark;
  std::int32_t feature = -1;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
  float sigma_px = 1.0F;
  std::int32_t camera = 0;
};

// Frames since the last keyframe in which a landmark should have been, and was, seen.
struct SightingCount {
  LandmarkHandle landmark;
  std::uint16_t visible = 0, found = 0;
};

// A request to make a frame a keyframe. Its pose is relative to a keyframe, which mapping may move and scale
// in the meantime.
struct KeyframeRequest {
  std::shared_ptr<Frame> frame;
  std::int32_t map_id = 0;
  std::uint64_t reference_id = 0;
  SE3 T_reference_body;  // in the reference's own unit (Keyframe::S_world_body)
  std::vector<Sighting> sightings;
  std::vector<SightingCount> counts;
};

struct InitialPoint {
  std::size_t feature_first = 0, feature_second = 0;
  double inverse_depth = 0;  // along the bearing in the first camera, 1 / baseline
};

// Two frames of known relative motion, by the images of one camera. Or one frame, `second` null, that two
// cameras of the rig show: they are its own pair.
struct InitialPair {
  std::shared_ptr<Frame> first, second;
  SE3 T_first_second;  // bodies, unit baseline
  std::vector<InitialPoint> points;
  int camera = 0;
};

}  // namespace farpoint::slam
