// SPDX-License-Identifier: Apache-2.0
// What a keyframe measures of a landmark: the aligned place of its patch near a corner.
#pragma once

#include <cstdint>
#include <vector>

#include "slam/config.h"
#include "slam/map/map.h"
#include "slam/map/predict.h"

namespace farpoint::slam {

// Aligns the landmark's patch with the image of one camera of the keyframe, from corner `feature`. False
// where that view has no pixels or the patch is not there; *out is then undefined.
[[nodiscard]] bool measure_observation(const EstimatorConfig& config, const Map& map,
                                       const Landmark& landmark, KeyframeHandle handle, int camera,
                                       std::size_t feature, Observation* out);

// What predict() needs of a landmark.
[[nodiscard]] PredictionInput prediction_input(const Map& map, const Landmark& landmark);

// The same of many landmarks, one after the other: remembers where each host's last anchor is in the world,
// since most landmarks of a host hang on it by the same one, its camera.
class AnchorMemory {
 public:
  // Room for keyframe slots.
  explicit AnchorMemory(std::size_t keyframes) : last_(keyframes) {}

  // To be called where poses may have moved.
  void forget() { ++round_; }
  [[nodiscard]] PredictionInput prediction_input(const Map& map, const Landmark& landmark);

 private:
  struct Anchor {
    std::uint64_t round = 0;  // in which it was made; that of another is forgotten
    SE3 T_host_anchor, T_world_anchor;
    Eigen::Matrix3d R_world_anchor;
  };

  std::uint64_t round_ = 1;
  std::vector<Anchor> last_;  // one a keyframe slot
};

}  // namespace farpoint::slam
