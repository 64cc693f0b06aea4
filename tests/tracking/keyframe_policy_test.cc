// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/keyframe_policy.h"

#include <gtest/gtest.h>

namespace farpoint::slam {
namespace {

// A reference keyframe with near landmarks and as many distant ones.
class KeyframePolicyTest : public testing::Test {
 protected:
  static constexpr int kOfEach = 100;
  static constexpr double kNear = 1.0 / 8.0, kDistant = 1.0 / 400.0;  // 1 / distance

  KeyframePolicyTest() {
    view.reference_landmarks = 2 * kOfEach;
    view.reference_nearness = kOfEach * (kNear + kDistant);
    Camera::Parameters p;
    p.width_px = 1241, p.height_px = 376;
    p.fx_px = p.fy_px = 718, p.cx_px = 607, p.cy_px = 185;
    view.rig.cameras.push_back({"front", Camera(p), {}});
    outcome.T_world_body.t.x() = 1.0;
  }

  bool wanted_with(int near, int distant, double since_keyframe_s = 0.2) {
    outcome.inliers = outcome.reference_inliers = near + distant;
    outcome.reference_nearness = near * kNear + distant * kDistant;
    return wants_keyframe(config, view, outcome, {since_keyframe_s, true});
  }

  EstimatorConfig config;
  LocalView view;
  TrackOutcome outcome;
};

TEST_F(KeyframePolicyTest, KeepsTheReferenceWhileItsLandmarksAreTracked) {
  EXPECT_FALSE(wanted_with(kOfEach, kOfEach));
}

// Most landmarks are distant, and the median of all hardly moves.
TEST_F(KeyframePolicyTest, MissesNearLandmarksThoughDistantOnesStay) {
  EXPECT_TRUE(wanted_with(40, kOfEach));
  EXPECT_FALSE(wanted_with(60, kOfEach));
}

TEST_F(KeyframePolicyTest, DoesNotMissDistantLandmarksWhileNearOnesStay) {
  EXPECT_FALSE(wanted_with(kOfEach, 10));
}

// However fast mapping is: the local window would reach back too short a way.
TEST_F(KeyframePolicyTest, KeepsADistanceFromTheLastKeyframe) {
  config.keyframes.min_interval_s = 0.15;
  EXPECT_FALSE(wanted_with(40, kOfEach, 0.14));
  EXPECT_TRUE(wanted_with(40, kOfEach, 0.15));
  config.keyframes.min_interval_s = 0.3;
  EXPECT_FALSE(wanted_with(40, kOfEach, 0.28));
  // A frame that comes a little early.
  EXPECT_TRUE(wanted_with(40, kOfEach, 0.2995));
}

// The same view turns by the same angle, whatever the lens.
TEST_F(KeyframePolicyTest, MotionInTheImageIsAnAngle) {
  outcome.inliers = outcome.reference_inliers = 2 * kOfEach;
  outcome.reference_nearness = view.reference_nearness;
  for (const double focal_px : {160.0, 718.0}) {
    Camera::Parameters p = view.rig.cameras.front().camera.parameters();
    p.fx_px = p.fy_px = focal_px;
    view.rig.cameras.front().camera = Camera(p);
    outcome.median_motion_px = 1.1 * config.keyframes.min_parallax_rad * focal_px;
    EXPECT_TRUE(wants_keyframe(config, view, outcome, {0.2, true})) << focal_px;
    outcome.median_motion_px = 0.9 * config.keyframes.min_parallax_rad * focal_px;
    EXPECT_FALSE(wants_keyframe(config, view, outcome, {0.2, true})) << focal_px;
  }
}

TEST_F(KeyframePolicyTest, StandingStillNothingIsNew) {
  outcome.T_world_body.t.x() = 0.01;
  EXPECT_FALSE(wanted_with(40, kOfEach));
}

TEST_F(KeyframePolicyTest, TurningOnTheSpotHalfOfAllMayLeave) {
  outcome.T_world_body.t.x() = 0.0;
  EXPECT_TRUE(wanted_with(45, 45));
  EXPECT_FALSE(wanted_with(55, 55));
}

}  // namespace
}  // namespace farpoint::slam
