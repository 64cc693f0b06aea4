#include "slam/tracking/keyframe_policy.h"

namespace farpoint::slam {

bool wants_keyframe(const EstimatorConfig& config, const LocalView& view, const TrackOutcome& outcome,
                    const KeyframeSituation& situation) {
  if (situation.frames_since_keyframe < 1 || !situation.mapping_free) return false;
  // Too few to be worth building on.
  if (outcome.inliers < config.tracking.min_matches) return false;
  const bool moved = outcome.median_motion_px > config.keyframes.min_parallax_px;
  const bool drifted = outcome.median_motion_px > 0.25 * config.keyframes.min_parallax_px;
  const bool old = situation.frames_since_keyframe >= config.keyframes.max_interval_frames;
  const bool thin = outcome.reference_inliers < config.keyframes.tracked_ratio * view.reference_landmarks;
  const bool very_thin = outcome.reference_inliers < 0.5 * view.reference_landmarks;
  // Standing still nothing is new, however old the keyframe; turning on the spot only what leaves the image
  // counts.
  return moved || (old && drifted) || (thin && drifted) || very_thin;
}

}  // namespace farpoint::slam
