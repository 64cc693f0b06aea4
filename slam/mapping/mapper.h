// SPDX-License-Identifier: Apache-2.0
// Mapping: keyframes in, local views out. The only writer of the map.
//
// Orders the work on one keyframe; each step is a part of its own (duplicates, landmark_maker, probation,
// window, settling, forgetting, view_builder). Not thread-safe: one thread calls everything.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "slam/map/local_view.h"
#include "slam/map/map.h"
#include "slam/map/request.h"
#include "slam/mapping/calibrator.h"
#include "slam/mapping/counts.h"
#include "slam/mapping/duplicates.h"
#include "slam/mapping/keyframe_maker.h"
#include "slam/mapping/landmark_maker.h"
#include "slam/mapping/probation.h"
#include "slam/mapping/rig_calibrator.h"
#include "slam/mapping/rig_depth.h"
#include "slam/mapping/settling.h"
#include "slam/mapping/view_builder.h"
#include "slam/mapping/window.h"
#include "slam/solver/motion_factors.h"
#include "slam/solver/schur_solver.h"
#include "slam/stages.h"

namespace farpoint::slam {

class Mapper {
 public:
  Mapper(const EstimatorConfig& config, const Rig& rig);
  // The parts refer to one another.
  Mapper(const Mapper&) = delete;
  Mapper& operator=(const Mapper&) = delete;

  // The listener must outlive this; null ends listening.
  void listen(StageListener* listener) { listener_ = listener; }

  // Motion between keyframes by another sensor, which must outlive this; null: none.
  void use_motion(MotionFactors* motion) { motion_ = motion; }

  // Starts a new map from two views. Null where too few points survive adjustment; the map is then discarded.
  // From one frame that two cameras show, where the pair has no second: such a map is metric.
  std::shared_ptr<const LocalView> start_map(const InitialPair& pair, std::int32_t map_id);

  // Inserts a keyframe and returns the quick view: new landmarks, poses not yet optimised. Null where the
  // reference is unknown or the map is full.
  std::shared_ptr<const LocalView> insert(const KeyframeRequest& request);
  // Refines around the keyframe inserted last and returns the full view: duplicates fused, poses and depths
  // optimised, redundant keyframes culled. Null where that keyframe was removed.
  std::shared_ptr<const LocalView> refine();

  // Removes a map with all its keyframes and landmarks.
  void discard_map(std::int32_t map_id) { map_.discard_map(map_id); }
  // Keeps a map that no keyframe is added to any more; its keyframes free their pixels.
  void retire_map(std::int32_t map_id);
  // Gives a map another origin, other axes or another unit. Every later view holds the correction.
  void transform_map(std::int32_t map_id, const Sim3& S_new_old) { map_.transform(map_id, S_new_old); }

  [[nodiscard]] const Map& map() const { return map_; }
  // Whether another sensor has made the map's unit the metre.
  [[nodiscard]] bool has_metre(std::int32_t map_id) const;
  [[nodiscard]] const MappingCounts& counts() const { return counts_; }
  [[nodiscard]] const Calibrator& calibrator() const { return calibrator_; }
  [[nodiscard]] std::size_t view_bytes() const { return view_builder_.bytes(); }
  [[nodiscard]] std::size_t adjustment_bytes() const { return window_.bytes() + solver_.bytes(); }

 private:
  std::shared_ptr<const LocalView> start_metric_map(const Frame& frame, std::int32_t map_id);
  void make_full(std::int32_t map_id);
  void add_initial_landmarks(const InitialPair& pair, KeyframeHandle first, KeyframeHandle second);
  [[nodiscard]] bool add_initial_landmark(const InitialPoint& point, Observer first, Observer second);
  [[nodiscard]] std::size_t count_landmarks(std::int32_t map_id) const;
  void note_creation_sigmas(std::int32_t map_id);
  void attach_sightings(KeyframeHandle keyframe, const KeyframeRequest& request);
  void make_landmarks(KeyframeHandle keyframe);
  void count_virtual_points();
  // Local bundle adjustment. False where nothing was optimised or the solution is unusable.
  bool optimise(KeyframeHandle centre, int iterations);
  void judge_motion(KeyframeHandle newest);
  // The unit is the metre by the cameras' own baseline.
  [[nodiscard]] bool metric_by_rig() const {
    return rig_calibrator_.has_value() && settling_.judgement().metre() == MetreSource::kCameras;
  }
  void refine_calibration();
  void refine_rig();
  void forget(KeyframeHandle newest);
  [[nodiscard]] std::shared_ptr<const LocalView> make_view(KeyframeHandle reference) {
    return view_builder_.build(reference, settling_.judgement());
  }

  const EstimatorConfig config_;
  Map map_;
  MappingCounts counts_;
  KeyframeMaker keyframe_maker_;
  Duplicates duplicates_;
  LandmarkMaker landmark_maker_;
  RigDepth rig_depth_;
  Probation probation_;
  Window window_;
  SchurSolver solver_;
  Settling settling_;
  Calibrator calibrator_;
  std::optional<RigCalibrator> rig_calibrator_;  // of two cameras
  ViewBuilder view_builder_;
  MotionFactors* motion_ = nullptr;
  std::vector<std::int32_t> metric_maps_;  // by motion_, ascending
  StageListener* listener_ = nullptr;
};

}  // namespace farpoint::slam
