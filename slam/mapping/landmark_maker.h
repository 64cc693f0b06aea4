// SPDX-License-Identifier: Apache-2.0
// Algorithm 1 of Dou et al. 2024 as METHOD.md reads it: feature pairs between a new keyframe and its
// neighbours become map points at once where the parallax suffices, and virtual map points (VMP, here
// landmarks of state `bearing`) that wait for parallax where it does not.
#pragma once

#include <optional>
#include <vector>

#include "slam/config.h"
#include "slam/map/map.h"
#include "slam/map/predict.h"
#include "slam/mapping/counts.h"
#include "slam/mapping/epipolar_index.h"

namespace farpoint::slam {

class LandmarkMaker {
 public:
  LandmarkMaker(const EstimatorConfig& config, Map* map, MappingCounts* counts);

  // Pairs each camera of the new keyframe with the same camera of its neighbours: makes landmarks, adds
  // observations and promotes.
  void process(KeyframeHandle newer, const std::vector<KeyframeHandle>& neighbours);
  // Call after tracking has seen a VMP once more: promotes it where it suffices now.
  void reconsider(LandmarkHandle handle);
  // Removes VMPs that were not seen for a while, and the least useful ones beyond the limit.
  void evict_bearings(KeyframeHandle newest);

  // Inverse depth from every observation, given the poses. False where it is behind a camera or an
  // observation disagrees (chi-square); *worst is then the one that disagrees most.
  struct DepthFit {
    bool ok = false;
    double inverse_depth = 0, sigma = 0, max_chi2 = 0;
    Observer worst;
  };
  [[nodiscard]] DepthFit fit_depth(const Landmark& landmark) const;

 private:
  // Two features that show the same point, by descriptors, epipolar line and alignment.
  struct Pair {
    std::size_t feature_new = 0, feature_old = 0;
    int distance = 0;
  };
  struct PairGeometry {
    SE3 T_new_old;              // cameras
    Eigen::Matrix3d R_old_new;  // the same the other way
    Eigen::Vector3d t_old_new;
    double max_inverse_depth = 0;  // nearest depth searched
    bool valid = false;
  };

  void pair_views(Observer newer, Observer older);
  [[nodiscard]] PairGeometry relate(Observer newer, Observer older) const;
  void find_pairs(Observer newer, Observer older, const PairGeometry& geometry, std::vector<Pair>* out);
  // The epipolar segment of a feature from infinity to the nearest depth, in pixels of the other keyframe.
  // False where nothing of it can be seen there.
  static bool epipolar_segment(const Eigen::Vector3f& bearing_new, const Camera& camera_old,
                               const PairGeometry& geometry, Eigen::Vector2d* far, Eigen::Vector2d* near);
  void consume(Observer newer, Observer older, const PairGeometry& geometry, const Pair& pair);
  void create(Observer newer, Observer older, const PairGeometry& geometry, const Pair& pair);
  void attach(LandmarkHandle handle, Observer observer, std::size_t feature);
  void merge(LandmarkHandle into, LandmarkHandle from);
  void try_promote(LandmarkHandle handle, bool through_vmp);
  [[nodiscard]] bool enough_information(const Landmark& landmark, const DepthFit& fit) const;
  // Whether other keyframes confirm a point that only two have seen. On repeated texture (guard rails, lane
  // markings, rows of posts, asphalt) the two corners may be different things. Where the true match has left
  // the image or looks too different, a wrong one that moves with the vehicle wins. It becomes a distant
  // point of small sigma. A third image does not show such a point where its depth puts it. True also where
  // no other keyframe should show the point.
  [[nodiscard]] bool found_elsewhere(const Landmark& landmark) const;
  // Whether the patch is found in the first view of the keyframe that should show it; null where none should.
  [[nodiscard]] std::optional<bool> shows(const Keyframe& witness, const Landmark& landmark,
                                          const PredictionInput& input) const;
  [[nodiscard]] bool wanted(LandmarkHandle handle) const;
  [[nodiscard]] const KeyframeView& view_of(Observer observer) const {
    return map_.keyframes()[observer.keyframe].views[observer.camera];
  }

  const EstimatorConfig& config_;
  Map& map_;
  MappingCounts& counts_;
  std::vector<float> level_scale_;         // of each pyramid level
  std::vector<KeyframeHandle> witnesses_;  // neighbours of the keyframe last processed
  // Work space, reused.
  EpipolarIndex index_;
  std::vector<std::uint8_t> wanted_old_;  // one a feature of the older keyframe
  std::vector<std::uint32_t> seen_by_;    // one a landmark slot: the round in which the older keyframe saw it
  std::uint32_t round_ = 0;
  std::vector<Pair> pairs_;
  std::vector<int> best_of_old_;  // one a feature of the older keyframe: index in pairs_
};

}  // namespace farpoint::slam
