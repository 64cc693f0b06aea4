// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/keyframe_policy.h"

namespace farpoint::slam {

namespace {

// Across the way since the reference keyframe, of its landmarks, gone or not, were they all seen from the
// side.
double mean_parallax_px(const LocalView& view, const TrackOutcome& outcome) {
  if (view.reference_landmarks == 0 || view.rig.cameras.empty()) return 0.0;
  const double way = (outcome.T_world_body.t - view.T_world_reference.t).norm();
  return view.rig.cameras.front().camera.focal_px() * way * view.reference_nearness /
         view.reference_landmarks;
}

}  // namespace

bool wants_keyframe(const EstimatorConfig& config, const LocalView& view, const TrackOutcome& outcome,
                    const KeyframeSituation& situation) {
  // A frame that comes a little early is not left out for the next.
  constexpr double kEarly_s = 0.001;
  if (situation.since_keyframe_s < config.keyframes.min_interval_s - kEarly_s || !situation.mapping_free)
    return false;
  // Too few to be worth building on.
  if (outcome.inliers < config.tracking.min_matches) return false;
  const double min_parallax_px =
      config.keyframes.min_parallax_rad * view.rig.cameras.front().camera.focal_px();
  const bool moved = outcome.median_motion_px > min_parallax_px;
  const bool drifted = outcome.median_motion_px > 0.25 * min_parallax_px;
  const bool old = situation.since_keyframe_s >= config.keyframes.max_interval_s - kEarly_s;
  const bool thin = outcome.reference_inliers < config.keyframes.tracked_ratio * view.reference_landmarks;
  const bool very_thin = outcome.reference_inliers < 0.5 * view.reference_landmarks;
  // By number distant landmarks, which stay in the image, hide that the near ones, which hold the
  // translation, have left it. Counted by nearness they do not; nor do they hide that the camera has moved.
  const bool near_gone = outcome.reference_nearness < 0.5 * view.reference_nearness &&
                         mean_parallax_px(view, outcome) > 0.25 * min_parallax_px;
  // Standing still nothing is new, however old the keyframe; turning on the spot only what leaves the image
  // counts.
  return moved || (old && drifted) || (thin && drifted) || very_thin || near_gone;
}

}  // namespace farpoint::slam
