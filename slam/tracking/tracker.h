// SPDX-License-Identifier: Apache-2.0
// Frame -> pose against an immutable local view: prior, coarse pose, fine pose. Reads no map and never waits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "slam/config.h"
#include "slam/geometry/motion_model.h"
#include "slam/map/frame.h"
#include "slam/map/local_view.h"
#include "slam/map/request.h"
#include "slam/stages.h"
#include "slam/tracking/constant_velocity.h"
#include "slam/tracking/matcher.h"
#include "slam/tracking/pose_errors.h"
#include "slam/tracking/pose_refiner.h"
#include "slam/tracking/relocaliser.h"
#include "slam/tracking/sighting_counter.h"
#include "slam/tracking/track_outcome.h"
#include "slam/tracking/velocity_filter.h"

namespace farpoint::slam {

// One thread. Makes no heap call after construction while views and frames keep to the configured capacities.
class Tracker {
 public:
  // `cameras`: of a frame; work space is allocated for as many.
  explicit Tracker(const EstimatorConfig& config, int cameras = 1);
  Tracker(const Tracker&) = delete;
  Tracker& operator=(const Tracker&) = delete;

  void listen(StageListener* listener);
  // Source of track()'s prior, which must outlive the tracker. Null: constant velocity of the accepted
  // frames.
  void use_motion_model(const MotionModel* model) { motion_model_ = model; }

  // Takes a newer view. Pose and motion prior follow the newest keyframe that both views contain, in the unit
  // of the newer view. Returns the change of unit (ConstantVelocity::correct); 1 for the first view.
  double set_view(std::shared_ptr<const LocalView> view);
  [[nodiscard]] const LocalView* view() const { return matcher_.view().get(); }
  [[nodiscard]] std::shared_ptr<const LocalView> shared_view() const { return matcher_.view(); }
  // Takes another tracker's view and the landmarks that its newest frame saw, for track_from(). Null lets go
  // of the view.
  void adopt(std::shared_ptr<const LocalView> view, std::span<const LandmarkHandle> seen);

  // Forgets view, pose, prior and counts: a new map begins at this pose.
  void start(const SE3& T_world_body, std::int64_t utime);

  // Pose of the frame from the motion prior: first from the last frame's landmarks, then from the local map.
  // The prior's information weighs beside the images'.
  TrackOutcome track(const Frame& frame);
  // The same from a given prior; leaves the accepted poses alone.
  TrackOutcome track_from(const Frame& frame, const PosePrior& prior);
  TrackOutcome track_from(const Frame& frame, const SE3& T_world_body_prior) {
    return track_from(frame, PosePrior{T_world_body_prior, Matrix6d::Zero()});
  }
  // The same for the frame after accept_on_trial(), nearer to the prior: a pose that is right needs no wide
  // search.
  TrackOutcome confirm(const Frame& frame);
  // Pose of a frame after frames without one, from the last confirmed motion (Relocaliser). Not ok where the
  // landmarks found contradict each other.
  TrackOutcome relocalise(const Frame& frame);

  // Accepts the outcome of track() as this frame's pose.
  void accept(const Frame& frame, const TrackOutcome& outcome);
  // Accepts the outcome of relocalise() until a second frame supports it: relocalise() goes on from the last
  // confirmed pose until the next accept().
  void accept_on_trial(const Frame& frame, const TrackOutcome& outcome);

  // The body moved on unseen, by another sensor: relocalise() searches from there.
  void carry(const SE3& T_from_to, std::int64_t utime) { motion_.carry(T_from_to, utime); }

  // Inlier sightings of the last search.
  void sightings(std::vector<Sighting>* out) const;
  // Counts of the accepted frames since the last call.
  void take_counts(std::vector<SightingCount>* out) { counter_.take(out); }
  // Landmarks that the last accepted frame saw.
  void last_seen(std::vector<LandmarkHandle>* out) const { *out = last_seen_; }

  // At the last accepted frame, filtered; for those outside. In map units.
  [[nodiscard]] const VelocityFilter& velocity() const { return velocity_; }
  // Of the last accepted pose.
  [[nodiscard]] const PoseErrors& pose_errors() const { return errors_.errors(); }

  [[nodiscard]] const ConstantVelocity& motion() const { return motion_; }
  [[nodiscard]] const SE3& T_world_body() const { return motion_.newest().T_world_body; }
  [[nodiscard]] const std::vector<Match>& matches() const { return matcher_.matches(); }
  // Velocity between the last two accepted frames, body axes: translation (map units a second), rotation (rad
  // a second).
  [[nodiscard]] Vector6d velocity_body() const { return motion_.velocity_body(); }
  // Bytes of the work space.
  [[nodiscard]] std::size_t bytes() const;

 private:
  [[nodiscard]] const MotionModel& motion_model() const {
    return motion_model_ != nullptr ? *motion_model_ : motion_;
  }
  TrackOutcome track_within(const Frame& frame, const PosePrior& prior, int attempts);
  bool coarse_pose(const Frame& frame, const PosePrior& prior, int attempts, SE3* T_world_body);
  [[nodiscard]] bool explains_matches(const PoseSolution& solution) const;
  void note_motion(const Motion& before, const Frame& frame, const SE3& T_world_body);
  void note_seen();

  const TrackingConfig config_;
  ConstantVelocity motion_;
  const MotionModel* motion_model_ = nullptr;
  Matcher matcher_;
  PoseRefiner refiner_;
  Relocaliser relocaliser_;
  SightingCounter counter_;
  PoseErrorModel errors_;
  VelocityFilter velocity_;
  std::vector<LandmarkHandle> last_seen_;       // inliers of the last accepted frame
  std::vector<LandmarkHandle> confirmed_seen_;  // inliers of the last frame that was not on trial
};

}  // namespace farpoint::slam
