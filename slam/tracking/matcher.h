// SPDX-License-Identifier: Apache-2.0
// Association of one frame's features with the landmarks of the local view: project, match, align.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "slam/config.h"
#include "slam/map/frame.h"
#include "slam/map/local_view.h"
#include "slam/map/predict.h"
#include "slam/stages.h"

namespace farpoint::slam {

// A landmark of the view matched to a feature of one camera of the frame.
struct Match {
  std::uint32_t view_index = 0;  // in LocalView::landmarks
  std::int32_t feature = -1;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // measured, level 0
  float sigma_px = 1.0F;                            // its error, level-0 pixels
  bool aligned = false;
  bool inlier = false;
  bool further = false;  // by measure_further(): beside a match of camera 0, whose feature it has
  std::uint8_t camera = 0;
};

// A landmark of the view that projects into one camera of the frame.
struct MatchCandidate {
  std::uint32_t view_index = 0;  // in LocalView::landmarks
  int camera = 0;
  Prediction prediction;
  int level = 0;  // pyramid level on which its corner is expected
};

// Which landmarks of the view are searched for.
enum class LandmarkSubset : std::uint8_t {
  kSeen,    // those marked as seen
  kRecent,  // the same and those of the reference keyframe
  kAll,
};

// The matches of one frame, over all its cameras. A feature belongs to one match at most, and a landmark to
// one a camera at most. Cameras come one after the other in every list.
//
// Tracking's thread. Makes no heap call after construction while view and frame keep to the configured
// capacities. Every index refers to the view of the last set_view(); matching needs a view.
class Matcher {
 public:
  // `cameras`: of a frame; work space is allocated for as many.
  explicit Matcher(const EstimatorConfig& config, int cameras = 1);
  void listen(StageListener* listener) { listener_ = listener; }

  // Takes another view and forgets which landmarks were seen. Null lets go of the present view.
  void set_view(std::shared_ptr<const LocalView> view);
  [[nodiscard]] const std::shared_ptr<const LocalView>& view() const { return view_; }
  // Marks these landmarks, and no others, as seen; skips those that the view does not contain.
  void mark_seen(std::span<const LandmarkHandle> seen);
  [[nodiscard]] bool in_subset(std::size_t view_index, LandmarkSubset subset) const {
    if (subset == LandmarkSubset::kAll || seen_[view_index] != 0) return true;
    return subset == LandmarkSubset::kRecent && view_->landmarks[view_index].in_reference;
  }
  // A camera as the view has it calibrated.
  [[nodiscard]] const RigCamera& camera(int index) const {
    return view_->rig.cameras[static_cast<std::size_t>(index)];
  }

  // Drops all matches; every feature of the frame is free.
  void begin(const Frame& frame);
  // Replaces the candidates by the landmarks of the subset that the cameras of a body at this pose could
  // match.
  void project(const Frame& frame, const SE3& T_world_body, LandmarkSubset subset);
  // Matches candidates that have no match with free features, by descriptor. `radius_px`: half width of the
  // window on level 0; it grows with the candidate's level and with the sigma of its depth. `ratio`: of
  // DescriptorQuery. Returns the number of new matches.
  int match(const Frame& frame, double radius_px, float ratio);
  // Matches a landmark with a feature of one camera, unless the feature is taken.
  void add(const Frame& frame, std::uint32_t view_index, int camera, std::int32_t feature);
  // Measures each match to a fraction of a pixel. Drops a match that does not align or is no candidate, and
  // frees the feature of one that does not align. Without pixels the matches stay as they are.
  void align(const Frame& frame);
  // Looks for each aligned match of camera 0 in the further cameras' pixels, where the landmark's depth and a
  // body at this pose put it, and adds what aligns as matches of those cameras: with the feature of camera 0.
  // Landmarks whose depth leaves their place open by more than alignment finds are left out.
  void measure_further(const Frame& frame, const SE3& T_world_body);
  // Drops the matches that are no inliers and frees their features.
  void drop_outliers();

  [[nodiscard]] const std::vector<MatchCandidate>& candidates() const { return candidates_; }
  [[nodiscard]] const std::vector<Match>& matches() const { return matches_; }
  [[nodiscard]] const ViewLandmark& landmark_of(const Match& match) const {
    return view_->landmarks[match.view_index];
  }
  void set_inlier(std::size_t match, bool inlier) { matches_[match].inlier = inlier; }

  // Bytes of the work space.
  [[nodiscard]] std::size_t bytes() const;

 private:
  void project_into(int index, const SE3& T_world_body, LandmarkSubset subset);
  [[nodiscard]] Match make_match(const Frame& frame, std::uint32_t view_index, int camera,
                                 std::int32_t feature) const;
  [[nodiscard]] std::uint8_t& taken(int camera, std::int32_t feature) {
    return taken_[static_cast<std::size_t>(camera) * features_ + static_cast<std::size_t>(feature)];
  }
  // Index of a landmark of the view in a list with one part a camera.
  [[nodiscard]] std::size_t slot(int camera, std::uint32_t view_index) const {
    return static_cast<std::size_t>(camera) * view_->landmarks.size() + view_index;
  }
  void measure_in(const Frame& frame, int index, const SE3& T_world_body, std::size_t matches);
  [[nodiscard]] bool align_one(const Frame& frame, const Prediction& prediction, Match* match) const;

  const TrackingConfig config_;
  const PyramidOptions pyramid_;
  std::vector<double> level_scale_;  // of each pyramid level
  StageListener* listener_ = nullptr;
  std::shared_ptr<const LocalView> view_;

  std::vector<MatchCandidate> candidates_;
  std::vector<Match> matches_;
  std::size_t features_ = 0;                // most of one camera of the frame
  std::vector<std::uint8_t> taken_;         // one a camera and feature: it belongs to a match
  std::vector<std::uint8_t> seen_;          // one a view landmark
  std::vector<std::uint8_t> matched_;       // one a camera and view landmark; valid within match()
  std::vector<std::int32_t> candidate_of_;  // the same: index in candidates_, or -1; valid within align()
  // One a landmark slot of the map: index in the view. An entry is valid where the view has the handle there.
  std::vector<std::uint32_t> view_index_of_slot_;
};

}  // namespace farpoint::slam
