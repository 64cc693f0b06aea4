// SPDX-License-Identifier: Apache-2.0
// What tracking found out about one frame.
#pragma once

#include "slam/geometry/se3.h"

namespace farpoint::slam {

struct TrackOutcome {
  bool ok = false;  // a pose that may be used
  SE3 T_world_body;
  Matrix6d covariance = Matrix6d::Zero();            // (dt, dphi) of se3.h
  int matches = 0;                                   // after the local search
  int inliers = 0, aligned = 0;                      // of the final pose
  int confirmed_matches = 0, confirmed_inliers = 0;  // of landmarks whose probation has ended
  int reference_inliers = 0;                         // inliers among the reference keyframe's landmarks
  double reference_nearness = 0;                     // sum of their nearness, 1 / map units
  int expected = 0;                                  // landmarks that project into the image
  double usually_found = 0;     // of these, by their share of frames; relocalisation only
  double median_motion_px = 0;  // of inliers since the reference keyframe, without rotation
  double rms = 0;               // of the inliers' residuals, in sigmas

  // Least share of inliers among the matches. Rigid scenes show 0.7 and more.
  static constexpr double kMinAgreement = 0.65;
  // Whether the matched landmarks agree on the pose.
  [[nodiscard]] bool agreed() const { return inliers >= kMinAgreement * matches; }
  // Of the landmarks that are usually found when they project into the image, those found here: about a half.
  // 1 where usually_found is not counted.
  [[nodiscard]] double found_share() const { return usually_found > 0.0 ? inliers / usually_found : 1.0; }
};

}  // namespace farpoint::slam
