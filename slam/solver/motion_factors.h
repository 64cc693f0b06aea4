// SPDX-License-Identifier: Apache-2.0
// How local bundle adjustment takes the motion between keyframes that a sensor beside the cameras measures.
// slam/mapping calls it, slam/fusion implements it.
#pragma once

#include <optional>
#include <span>

#include "slam/map/map.h"
#include "slam/map/map_judgement.h"
#include "slam/solver/bundle_problem.h"

namespace farpoint::slam {

// What the adjusted map says of the sensor, and the sensor of the map.
struct MotionVerdict {
  WheelTrust trust = WheelTrust::kNone;
  double wheel_factor = 1.0;              // metres driven in one that the wheels tell
  double unit_sigma = 0.0;                // of the metre, relative; 0 where the sensor does not give it
  std::optional<double> metres_per_unit;  // the map's unit is to become the metre
};

// Mapping's thread.
class MotionFactors {
 public:
  MotionFactors() = default;
  MotionFactors(const MotionFactors&) = delete;
  MotionFactors& operator=(const MotionFactors&) = delete;
  virtual ~MotionFactors() = default;

  // Adds factors between poses of the problem, which must stay alive until the next call. `pose_index`: of a
  // keyframe's pose, by its slot; -1 where the problem lacks it. `judgement`: of the map.
  virtual void add_to(const Map& map, std::span<const int> pose_index, const MapJudgement& judgement,
                      BundleProblem* problem) = 0;
  // After an adjustment whose newest keyframe is `newest`.
  virtual MotionVerdict judge(Map* map, KeyframeHandle newest, const MapJudgement& judgement) = 0;
};

}  // namespace farpoint::slam
