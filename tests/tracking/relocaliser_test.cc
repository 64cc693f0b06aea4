// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/relocaliser.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/tracking_scene.h"

namespace farpoint::slam {
namespace {

using test::SceneFrame;
using test::ScenePoint;
using test::TrackingScene;

class RelocaliserTest : public testing::Test {
 protected:
  RelocaliserTest() {
    for (std::size_t i = 0; i < scene.points.size(); ++i) scene.points[i].in_reference = i % 3 == 0;
    last.utime = 1'000'000;
    last.has_velocity = true;
  }
  // Searches a frame taken at this pose, so long after the last confirmed one.
  TrackOutcome relocalise(const SE3& T_world_body, double gap_s) {
    const SceneFrame shown = scene.look(T_world_body, last.utime + static_cast<std::int64_t>(gap_s * 1e6));
    matcher.set_view(scene.view());
    matcher.begin(*shown.frame);
    return relocaliser.relocalise(*shown.frame, last);
  }
  TrackingScene scene{240};
  Matcher matcher{scene.config};
  PoseRefiner refiner{scene.config, &matcher};
  Relocaliser relocaliser{scene.config, &matcher, &refiner};
  Motion last;
};

double error_of(const TrackOutcome& out, const SE3& truth) {
  return truth.boxminus_to(out.T_world_body).norm();
}

TEST_F(RelocaliserTest, FindsWhereTheMotionLed) {
  scene.add_doubles();
  last.velocity << 1.0, 0, 0, 0, 0, 0.8;  // 100 px, the window is 27 px
  const SE3 truth =
      last.extrapolated(0.3).boxplus((Vector6d() << 0.05, 0.02, 0, 0.01, 0.02, -0.02).finished());
  const TrackOutcome out = relocalise(truth, 0.3);
  ASSERT_TRUE(out.ok);
  EXPECT_LT(error_of(out, truth), 1e-3);
  EXPECT_GT(out.inliers, 100);
  EXPECT_EQ(out.inliers, out.aligned);
}

TEST_F(RelocaliserTest, FindsWhereTheVehicleStoodThoughItWasMoving) {
  scene.add_doubles();
  last.velocity << 1.0, 0, 0, 0, 0, 0.9;  // 52 degrees a second: the motion would have led out of sight
  const SE3 truth = TrackingScene::pose({0.05, 0, 0}, {0, 0, 0.02});
  const TrackOutcome out = relocalise(truth, 1.0);
  ASSERT_TRUE(out.ok);
  EXPECT_LT(error_of(out, truth), 1e-3);
}

TEST_F(RelocaliserTest, FindsATurnThatNothingForesaw) {
  const SE3 truth = TrackingScene::pose({0.5, 0.3, 0}, {0.3, 0, 0.25});
  const TrackOutcome out = relocalise(truth, 0.1);
  ASSERT_TRUE(out.ok);
  EXPECT_LT(error_of(out, truth), 1e-3);
}

TEST_F(RelocaliserTest, SearchesTheWholeViewWhereWhatWasSeenIsHidden) {
  for (ScenePoint& p : scene.points) p.visible = !p.in_reference;
  for (const double turn_rad : {0.01, 0.25}) {  // within the window, and beyond it
    const SE3 truth = TrackingScene::pose({0.2, 0, 0}, {turn_rad, 0, turn_rad});
    const TrackOutcome out = relocalise(truth, 0.1);
    ASSERT_TRUE(out.ok) << turn_rad;
    EXPECT_LT(error_of(out, truth), 1e-3) << turn_rad;
  }
}

// Most of the view moved together, which gives another pose with more matches.
TEST_F(RelocaliserTest, BelievesTheLandmarksSeenLastBeforeTheWholeView) {
  const std::shared_ptr<const LocalView> view = scene.view();
  for (ScenePoint& p : scene.points)
    if (!p.in_reference) p.position_w += Eigen::Vector3d(0, 0.6, 0.3);
  const SE3 truth = TrackingScene::pose({0.2, 0.1, 0}, {0, 0.01, 0});
  const SceneFrame shown = scene.look(truth, last.utime + 100'000);
  matcher.set_view(view);
  matcher.begin(*shown.frame);
  const TrackOutcome out = relocaliser.relocalise(*shown.frame, last);
  ASSERT_TRUE(out.ok);
  EXPECT_LT(error_of(out, truth), 5e-3);
}

TEST_F(RelocaliserTest, RefusesAPoseThatItsMatchesContradict) {
  const SE3 truth = TrackingScene::pose({0.2, 0, 0});
  EXPECT_TRUE(relocalise(truth, 0.1).ok);
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    if (i % 5 < 3) continue;  // 60 % agree
    const double angle_rad = scene.uniform(0, 2 * M_PI);
    scene.points[i].alignment_offset_px = 1.9 * Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad));
  }
  EXPECT_FALSE(relocalise(truth, 0.1).ok);
}

TEST_F(RelocaliserTest, RefusesAPoseOfTooFewLandmarks) {
  for (std::size_t i = 0; i < scene.points.size(); ++i) scene.points[i].visible = i < 29;
  EXPECT_FALSE(relocalise(SE3{}, 0.1).ok);
  scene.points[29].visible = scene.points[30].visible = scene.points[31].visible = true;
  EXPECT_TRUE(relocalise(SE3{}, 0.1).ok);
}

TEST_F(RelocaliserTest, FindsNothingInAnotherPlace) {
  matcher.set_view(scene.view());
  TrackingScene elsewhere(240, 99);
  const SceneFrame shown = elsewhere.look(SE3{}, last.utime + 100'000);
  matcher.begin(*shown.frame);
  EXPECT_FALSE(relocaliser.relocalise(*shown.frame, last).ok);
}

TEST_F(RelocaliserTest, BeginsWithConfirmedLandmarksOnly) {
  for (ScenePoint& p : scene.points) p.confirmed = false;
  EXPECT_FALSE(relocalise(SE3{}, 0.1).ok);
}

}  // namespace
}  // namespace farpoint::slam
