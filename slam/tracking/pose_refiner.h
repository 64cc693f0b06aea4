// SPDX-License-Identifier: Apache-2.0
// The fine step of tracking: a frame's pose from its matches with the whole local map.
#pragma once

#include <cstddef>
#include <vector>

#include "slam/config.h"
#include "slam/map/frame.h"
#include "slam/stages.h"
#include "slam/tracking/matcher.h"
#include "slam/tracking/pose_solver.h"
#include "slam/tracking/track_outcome.h"

namespace farpoint::slam {

// Tracking's thread; makes no heap call after construction.
class PoseRefiner {
 public:
  // `matcher` must outlive the refiner. `cameras`: of a frame.
  PoseRefiner(const EstimatorConfig& config, Matcher* matcher, int cameras = 1);
  void listen(StageListener* listener) { listener_ = listener; }

  // Solves the pose from the present matches and the prior's information, and marks which matches are
  // inliers.
  PoseSolution solve(const SE3& T_world_body_start, const PosePrior& prior = {});
  // Keeps the inliers among the present matches, adds matches with the view's other landmarks around `start`,
  // aligns all, and solves as above.
  TrackOutcome refine(const Frame& frame, const SE3& T_world_body_start, const PosePrior& prior = {});

  // Bytes of the work space.
  [[nodiscard]] std::size_t bytes() const;

 private:
  [[nodiscard]] int further_inliers() const;
  void count_inliers(TrackOutcome* outcome) const;
  [[nodiscard]] double motion_since_reference_px(const SE3& T_world_body);
  void add_motions_of(int index, const SE3& T_world_body);

  const TrackingConfig config_;
  Matcher& matcher_;
  StageListener* listener_ = nullptr;
  std::vector<PoseMeasurement> measurements_;
  std::vector<double> motions_px_;
};

}  // namespace farpoint::slam
