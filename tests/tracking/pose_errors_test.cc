// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/pose_errors.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <random>

#include "slam/tracking/tracker.h"
#include "tests/support/tracking_scene.h"

namespace farpoint::slam {
namespace {

using test::kFrame_us;
using test::ScenePoint;
using test::TrackingScene;

class PoseErrorsTest : public testing::Test {
 protected:
  PoseErrorsTest() {
    tracker.start(scene.T_world_reference, 0);
    tracker.set_view(scene.view());
  }
  const PoseErrors& errors_at(const SE3& T_world_body, int n) {
    const auto shown = scene.look(T_world_body, n * kFrame_us);
    const TrackOutcome outcome = tracker.track(*shown.frame);
    EXPECT_TRUE(outcome.ok) << n;
    tracker.accept(*shown.frame, outcome);
    return tracker.pose_errors();
  }
  // Errors of the aligned pixels.
  void disturb(double sigma_px) {
    std::normal_distribution<double> normal(0.0, sigma_px);
    for (ScenePoint& p : scene.points) p.alignment_offset_px = {normal(random), normal(random)};
  }
  // Root of the trace of the translation's part.
  static double size_of(const Matrix6d& m) { return std::sqrt(m.topLeftCorner<3, 3>().trace()); }

  TrackingScene scene{300};
  Tracker tracker{scene.config};
  std::mt19937_64 random{3};
};

TEST_F(PoseErrorsTest, AreUnknownBeforeTheFirstPose) {
  EXPECT_FALSE(tracker.pose_errors().known);
  EXPECT_TRUE(errors_at(SE3{}, 1).known);
  tracker.start(SE3{}, 0);
  EXPECT_FALSE(tracker.pose_errors().known);
}

TEST_F(PoseErrorsTest, NothingIsExchangedWhereTheSameLandmarksHoldThePose) {
  EXPECT_GT(size_of(errors_at(SE3{}, 1).exchanged), 0.0);
  for (int n = 2; n < 6; ++n) EXPECT_EQ(errors_at(SE3{}, n).exchanged, Matrix6d::Zero()) << n;
}

TEST_F(PoseErrorsTest, LandmarksThatComeInAreExchangedForThoseInUse) {
  for (std::size_t i = 0; i < scene.points.size(); i += 2) scene.points[i].visible = false;
  (void)errors_at(SE3{}, 1);
  EXPECT_EQ(errors_at(SE3{}, 2).exchanged, Matrix6d::Zero());
  for (ScenePoint& p : scene.points) p.visible = true;
  const PoseErrors& errors = errors_at(SE3{}, 3);
  EXPECT_GT(size_of(errors.exchanged), 0.0);
  EXPECT_EQ(errors_at(SE3{}, 4).exchanged, Matrix6d::Zero());
}

TEST_F(PoseErrorsTest, WhatResidualsHaveInCommonIsTheLandmarksAndNotTheFrames) {
  disturb(0.3);
  for (int n = 1; n < 10; ++n) (void)errors_at(SE3{}, n);
  EXPECT_LT(size_of(tracker.pose_errors().own), 0.05 * size_of(tracker.pose_errors().noise));
}

TEST_F(PoseErrorsTest, WhatChangesFromFrameToFrameIsTheFrames) {
  for (int n = 1; n < 10; ++n) {
    disturb(0.3);
    (void)errors_at(SE3{}, n);
  }
  EXPECT_GT(size_of(tracker.pose_errors().own), 0.6 * size_of(tracker.pose_errors().noise));
}

TEST_F(PoseErrorsTest, TwiceTheResidualsAreTwiceTheErrors) {
  disturb(0.1);
  for (int n = 1; n < 10; ++n) (void)errors_at(SE3{}, n);
  const double small = size_of(tracker.pose_errors().noise);
  for (ScenePoint& p : scene.points) p.alignment_offset_px *= 2.0;
  for (int n = 10; n < 100; ++n) (void)errors_at(SE3{}, n);
  EXPECT_NEAR(size_of(tracker.pose_errors().noise) / small, 2.0, 0.3);
}

// No covariance is singular, however well a pose fits.
TEST_F(PoseErrorsTest, APerfectFitHasAnErrorAllTheSame) {
  const Matrix6d noise = errors_at(SE3{}, 1).noise;
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(noise).eigenvalues().minCoeff(), 0.0);
}

// Few measurements far from a rotation's axis: errors of poses against truth, over noise of many frames.
TEST_F(PoseErrorsTest, OwnNoiseIsThatOfPosesOverFramesButForLandmarksCountedAsOne) {
  double square = 0.0, claimed = 0.0;
  for (int n = 1; n < 120; ++n) {
    disturb(0.3);
    const PoseErrors& errors = errors_at(SE3{}, n);
    if (n < 20) continue;
    square += tracker.T_world_body().t.squaredNorm();
    claimed += errors.own.topLeftCorner<3, 3>().trace();
  }
  // Each error of the scene stands alone: the claim is four times the variance.
  EXPECT_GT(claimed / square, 2.0);
  EXPECT_LT(claimed / square, 8.0);
}

}  // namespace
}  // namespace farpoint::slam
