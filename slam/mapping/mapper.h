// Keyframes in, local views out. The only writer of the map.
//
// One keyframe is two jobs: insert() ends with the quick view (new landmarks, poses not yet optimised),
// refine() with the full one (duplicates fused, local BA, culling).
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "slam/map/frame.h"
#include "slam/map/local_view.h"
#include "slam/map/map.h"
#include "slam/map/shared_pool.h"
#include "slam/mapping/calibrator.h"
#include "slam/mapping/counts.h"
#include "slam/mapping/landmark_maker.h"
#include "slam/mapping/measurement.h"
#include "slam/mapping/soundness.h"
#include "slam/solver/bundle_problem.h"
#include "slam/solver/schur_solver.h"
#include "slam/stages.h"

namespace farpoint::slam {

class Mapper {
 public:
  Mapper(const EstimatorConfig& config, const Rig& rig);
  void listen(StageListener* listener) { listener_ = listener; }

  // Starts a new map from two views. Null where the structure does not hold (too few points survive BA).
  std::shared_ptr<const LocalView> start_map(const InitialPair& pair, std::int32_t map_id);

  // Job 1. Null where the keyframe could not be used.
  std::shared_ptr<const LocalView> insert(const KeyframeRequest& request);
  // Job 2, on the keyframe inserted last.
  std::shared_ptr<const LocalView> refine();

  [[nodiscard]] const Map& map() const { return map_; }
  [[nodiscard]] Map& map() { return map_; }
  [[nodiscard]] const MappingCounts& counts() const { return counts_; }
  [[nodiscard]] const Calibrator& calibrator() const { return calibrator_; }
  [[nodiscard]] std::uint64_t newest_id() const { return newest_id_; }
  void discard_map(std::int32_t map_id) { map_.discard_map(map_id); }
  // The map is kept, but not built on any more: its keyframes give back their pixels.
  void retire_map(std::int32_t map_id);
  [[nodiscard]] std::size_t view_bytes() const;
  [[nodiscard]] std::size_t adjustment_bytes() const { return problem_.bytes() + solver_.bytes(); }

 private:
  KeyframeHandle make_keyframe(const Frame& frame, const SE3& T_world_body, std::int32_t map_id);
  void attach_sightings(KeyframeHandle keyframe, const KeyframeRequest& request);
  void cull_recent_landmarks();
  void count_virtual_points();
  [[nodiscard]] std::vector<KeyframeHandle> neighbours(KeyframeHandle keyframe, std::size_t limit) const;

  // Duplicates: landmarks of the one keyframe searched in the other.
  void fuse_neighbourhood(KeyframeHandle keyframe);
  void search_neighbours_landmarks(KeyframeHandle keyframe);
  void fuse(LandmarkHandle into, LandmarkHandle from);
  // Whether it is in the view that tracking gets. Local BA takes points only.
  [[nodiscard]] bool guides_tracking(const Landmark& landmark) const;
  void search_into(KeyframeHandle handle, const std::vector<LandmarkHandle>& landmarks);

  // False where there was nothing to optimise, or nothing usable came of it.
  bool optimise(KeyframeHandle centre, int iterations);
  void select_window(KeyframeHandle centre);
  void build_problem();
  void take_back();
  void refine_calibration();
  void update_settling(double scale_change);

  // From the pool; null where all views are in somebody's hands.
  std::shared_ptr<const LocalView> make_view(KeyframeHandle reference);

  const EstimatorConfig config_;
  Map map_;
  SharedPool<LocalView> views_;
  MappingCounts counts_;
  LandmarkMaker maker_;
  AnchorMemory anchors_;
  Calibrator calibrator_;
  StageListener* listener_ = nullptr;

  KeyframeHandle newest_;
  std::uint64_t newest_id_ = 0;
  std::uint64_t view_sequence_ = 0;
  std::size_t last_view_landmarks_ = 0;  // in the last view: about as many will be in the next
  std::vector<LandmarkHandle> recent_;   // made not long ago, on probation

  // Settling: how much the last optimisations still changed the young map's unit.
  int steady_optimisations_ = 0;
  bool settled_ = false;
  int sound_run_;        // sound optimisations since the last that was not
  Soundness soundness_;  // after the last one

  // Work space of local BA.
  BundleProblem problem_;
  SchurSolver solver_;
  std::vector<KeyframeHandle> window_, fixed_;
  std::vector<LandmarkHandle> problem_landmarks_;
  std::vector<int> pose_index_;  // one a keyframe slot: index in problem_.poses, or -1
};

}  // namespace farpoint::slam
