// What tracking hands to mapping: frames, sightings, keyframe requests, the pair a map starts from.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "slam/geometry/se3.h"
#include "slam/image/feature_grid.h"
#include "slam/map/landmark.h"

namespace farpoint::slam {

struct Frame {
  std::uint64_t number = 0;  // counts processed frames, from 0
  std::int64_t utime = 0;
  std::int64_t sequence = 0;
  int camera = 0;
  FeatureSet set;
  FeatureGrid grid;
  std::shared_ptr<const FrameImage> image;
};

// A landmark found in a frame.
struct Sighting {
  LandmarkHandle landmark;
  std::int32_t feature = -1;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
  float sigma_px = 1.0F;
};

// How often a landmark should have been, and was, seen since the last keyframe.
struct SightingCount {
  LandmarkHandle landmark;
  std::uint16_t visible = 0, found = 0;
};

// A frame that tracking wants remembered. The pose is relative to a keyframe, so that it stays right when
// mapping moves that keyframe in the meantime.
struct KeyframeRequest {
  std::shared_ptr<Frame> frame;
  std::int32_t map_id = 0;
  std::uint64_t reference_id = 0;
  SE3 T_reference_body;
  std::vector<Sighting> sightings;
  std::vector<SightingCount> counts;
};

struct InitialPoint {
  std::size_t feature_first = 0, feature_second = 0;
  double inverse_depth = 0;  // along the bearing in the first camera, 1 / baseline
};

// Two frames with known relative motion.
struct InitialPair {
  std::shared_ptr<Frame> first, second;
  SE3 T_first_second;  // bodies, unit baseline
  std::vector<InitialPoint> points;
};

}  // namespace farpoint::slam
