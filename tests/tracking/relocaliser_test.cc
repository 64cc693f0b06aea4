// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/relocaliser.h"

#include <gtest/gtest.h>

#include <algorithm>
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

// A twelfth of the view is there, in its right places, as where one facade looks like another.
TEST_F(RelocaliserTest, RefusesAPlaceThatLacksMostOfWhatIsUsuallyFound) {
  TrackingScene town(600);
  Matcher town_matcher{town.config};
  PoseRefiner town_refiner{town.config, &town_matcher};
  Relocaliser town_relocaliser{town.config, &town_matcher, &town_refiner};
  const auto relocalise_at = [&](const SE3& T_world_body, float found_share) {
    for (std::size_t i = 0; i < town.points.size(); ++i) {
      town.points[i].in_reference = i % 3 == 0;
      town.points[i].visible = i % 12 == 0;
      town.points[i].found_share = found_share;
    }
    const SceneFrame shown = town.look(T_world_body, last.utime += 100'000);
    town_matcher.set_view(town.view());
    town_matcher.begin(*shown.frame);
    return town_relocaliser.relocalise(*shown.frame, last);
  };
  const SE3 here = TrackingScene::pose({0.05, 0, 0}),
            turned = TrackingScene::pose({0.05, 0, 0}, {0.1, 0, 0.1});
  for (const SE3& T : {here, turned}) {
    EXPECT_FALSE(relocalise_at(T, 1.0F).ok);
    const TrackOutcome seldom = relocalise_at(T, 0.4F);
    EXPECT_TRUE(seldom.ok);
    EXPECT_NEAR(seldom.found_share(), 0.083 / 0.4, 0.03);
  }
}

TEST_F(RelocaliserTest, FindsNothingInAnotherPlace) {
  matcher.set_view(scene.view());
  TrackingScene elsewhere(240, 99);
  const SceneFrame shown = elsewhere.look(SE3{}, last.utime + 100'000);
  matcher.begin(*shown.frame);
  EXPECT_FALSE(relocaliser.relocalise(*shown.frame, last).ok);
}

// A large view in which next to nothing is found: the worst that a frame can cost.
TEST_F(RelocaliserTest, BoundsTheWorkOfAFrameAndSearchesEverythingInTurn) {
  TrackingScene large(3000);
  large.config.capacity.view_landmarks = 4000;
  large.config.capacity.landmarks = 8000;  // handles are spread
  Matcher large_matcher{large.config};
  PoseRefiner large_refiner{large.config, &large_matcher};
  Relocaliser large_relocaliser{large.config, &large_matcher, &large_refiner};
  TrackingScene elsewhere(3000, 99);
  for (std::size_t i = 0; i < elsewhere.points.size(); ++i) elsewhere.points[i].visible = i < 1200;
  large_matcher.set_view(large.view());
  constexpr int kFrames = 12;
  double least = 1e12, most = 0;
  for (int n = 1; n <= kFrames; ++n) {
    const SceneFrame shown = elsewhere.look(SE3{}, last.utime + n * 100'000);
    large_matcher.begin(*shown.frame);
    EXPECT_FALSE(large_relocaliser.relocalise(*shown.frame, last).ok);
    least = std::min(least, large_relocaliser.work());
    most = std::max(most, large_relocaliser.work());
  }
  EXPECT_GT(least, 1e4);
  // The last search to begin is one slice of four in the whole image, or the view around the motion.
  const double slice = 3000.0 / 4 * 1200 * 1.5, samples = 300 * 1500.0;
  EXPECT_LT(most, Relocaliser::kMostWork + slice + samples);
  // The whole view in one frame would be more.
  EXPECT_LT(most, 4 * slice);

  // Where the landmarks seen last cost more than that alone, nothing else is searched.
  for (std::size_t i = 0; i < large.points.size(); ++i) large.points[i].in_reference = i < 1100;
  large_matcher.set_view(large.view());
  const SceneFrame busy = elsewhere.look(SE3{}, last.utime + 2'000'000);
  large_matcher.begin(*busy.frame);
  EXPECT_FALSE(large_relocaliser.relocalise(*busy.frame, last).ok);
  EXPECT_GT(large_relocaliser.work(), 1.5e6);
  EXPECT_LT(large_relocaliser.work(), 2.5e6);

  // A turn of the camera that only the whole view shows is found within the turns.
  for (std::size_t i = 0; i < large.points.size(); ++i) {
    large.points[i].in_reference = i % 3 == 0;
    large.points[i].visible = i % 3 != 0 && i % 4 == 0;
    large.points[i].found_share = 0.2F;
  }
  large_matcher.set_view(large.view());
  const SE3 truth = TrackingScene::pose({0.2, 0, 0}, {0.25, 0, 0.25});
  last.utime += 10'000'000;
  bool found = false;
  for (int n = 1; n <= kFrames && !found; ++n) {
    const SceneFrame shown = large.look(truth, last.utime + 100'000);
    large_matcher.begin(*shown.frame);
    const TrackOutcome out = large_relocaliser.relocalise(*shown.frame, last);
    found = out.ok && error_of(out, truth) < 1e-3;
  }
  EXPECT_TRUE(found);
}

TEST_F(RelocaliserTest, BeginsWithConfirmedLandmarksOnly) {
  for (ScenePoint& p : scene.points) p.confirmed = false;
  EXPECT_FALSE(relocalise(SE3{}, 0.1).ok);
}

}  // namespace
}  // namespace farpoint::slam
