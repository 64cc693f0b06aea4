// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/tracker.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/ipc/allocations.h"
#include "tests/support/tracking_scene.h"

namespace farpoint::slam {
namespace {

using test::error_of;
using test::kFrame_us;
using test::SceneFrame;
using test::ScenePoint;
using test::TrackingScene;

class TrackerTest : public testing::Test {
 protected:
  TrackerTest() {
    for (std::size_t i = 0; i < scene.points.size(); ++i) scene.points[i].in_reference = i % 2 == 0;
  }
  // A map at the reference, and its first view.
  void start() {
    tracker.start(scene.T_world_reference, 0);
    tracker.set_view(scene.view());
  }
  // The n-th frame of a drive ahead with a slow turn.
  static SE3 drive(int n) { return TrackingScene::pose({0.1 * n, 0.01 * n, 0}, {0, 0, 0.01 * n}); }
  TrackOutcome track(int n) {
    shown = scene.look(drive(n), n * kFrame_us);
    return tracker.track(*shown.frame);
  }
  TrackOutcome track_and_accept(int n) {
    TrackOutcome out = track(n);
    EXPECT_TRUE(out.ok) << n;
    tracker.accept(*shown.frame, out);
    return out;
  }

  TrackingScene scene{300};
  Tracker tracker{scene.config};
  SceneFrame shown;
};

// --- frame by frame
// ------------------------------------------------------------------------------------------------

TEST_F(TrackerTest, ConfirmsOnlyWhatLiesNearThePrior) {
  for (ScenePoint& p : scene.points) p.host_level = 0;  // coarser levels have wider windows
  start();
  track_and_accept(1);
  // The prior is off by 30 px: wider than where a candidate is confirmed, within where a frame is tracked.
  const double off_rad = 3.0 * scene.config.tracking.prior_search_px / scene.camera().focal_px();
  const SE3 moved = drive(2).boxplus((Vector6d() << 0, 0, 0, 0, 0, off_rad).finished());
  shown = scene.look(moved, 2 * kFrame_us);
  EXPECT_FALSE(tracker.confirm(*shown.frame).ok);
  EXPECT_TRUE(tracker.track(*shown.frame).ok);
  shown = scene.look(drive(2), 2 * kFrame_us);
  EXPECT_TRUE(tracker.confirm(*shown.frame).ok);
}

TEST_F(TrackerTest, FollowsADrive) {
  start();
  for (int n = 1; n <= 10; ++n) {
    const TrackOutcome out = track_and_accept(n);
    EXPECT_LT(error_of(out.T_world_body, drive(n)), 1e-3) << n;
    EXPECT_LT(error_of(tracker.T_world_body(), drive(n)), 1e-3) << n;
    EXPECT_GT(out.inliers, 200);
    EXPECT_EQ(out.inliers, out.aligned);
    EXPECT_EQ(out.matches, out.inliers);
    EXPECT_GE(out.expected, out.matches);
    EXPECT_TRUE(out.agreed());
  }
  const Vector6d expected = drive(9).boxminus_to(drive(10)) * 10.0;
  EXPECT_LT((tracker.velocity_body() - expected).norm(), 0.02);
}

TEST_F(TrackerTest, TellsHowMuchOfTheReferenceIsLeftAndHowFarItMoved) {
  for (std::size_t i = 0; i < scene.points.size(); i += 3) scene.points[i].confirmed = false;
  start();
  const TrackOutcome out = track_and_accept(2);
  int reference = 0;
  double nearness = 0;
  std::vector<double> motions_px;
  const SE3 T_body_camera = scene.rig.cameras[0].T_body_camera;
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const ScenePoint& p = scene.points[i];
    if (shown.feature_of_point[i] < 0 || !p.confirmed) continue;
    const Eigen::Vector3d then = p.position_w - T_body_camera.t,
                          now = p.position_w - (drive(2) * T_body_camera).t;
    motions_px.push_back(std::acos(then.normalized().dot(now.normalized())) * scene.camera().focal_px());
    if (!p.in_reference) continue;
    ++reference;
    nearness += 1.0 / then.norm();
  }
  std::sort(motions_px.begin(), motions_px.end());
  // Corners within 4 px of the edge count on neither side of the median.
  EXPECT_NEAR(out.reference_inliers, reference, 3);
  EXPECT_NEAR(out.reference_nearness, nearness, 0.3);
  EXPECT_NEAR(out.median_motion_px, motions_px[motions_px.size() / 2], 0.2);
}

TEST_F(TrackerTest, HasNoPoseWithoutAView) {
  shown = scene.look(SE3{}, kFrame_us);
  EXPECT_FALSE(tracker.track(*shown.frame).ok);
  EXPECT_FALSE(tracker.relocalise(*shown.frame).ok);
  start();
  EXPECT_TRUE(tracker.track(*shown.frame).ok);
  tracker.start(SE3{}, 0);
  EXPECT_EQ(tracker.view(), nullptr);
  EXPECT_FALSE(tracker.track(*shown.frame).ok);
}

TEST_F(TrackerTest, HasNoPoseInAnotherPlace) {
  start();
  TrackingScene elsewhere(300, 99);
  const SceneFrame other = elsewhere.look(SE3{}, kFrame_us);
  EXPECT_FALSE(tracker.track(*other.frame).ok);
}

class FixedMotion final : public MotionModel {
 public:
  [[nodiscard]] PosePrior predict(std::int64_t utime) const override {
    asked_utime = utime;
    return prior;
  }
  [[nodiscard]] Vector6d velocity_body() const override { return Vector6d::Zero(); }
  PosePrior prior;
  mutable std::int64_t asked_utime = 0;
};

TEST_F(TrackerTest, StartsFromTheMotionModelItIsGiven) {
  start();
  FixedMotion model;
  // 0.5 rad: far outside the widest window.
  const SE3 far_away = TrackingScene::pose({0.3, 0, 0}, {0, 0, 0.5});
  shown = scene.look(far_away, 3 * kFrame_us);
  EXPECT_FALSE(tracker.track(*shown.frame).ok);
  model.prior.T_world_body = TrackingScene::pose({0.25, 0, 0}, {0, 0, 0.49});
  tracker.use_motion_model(&model);
  const TrackOutcome out = tracker.track(*shown.frame);
  EXPECT_TRUE(out.ok);
  EXPECT_LT(error_of(out.T_world_body, far_away), 1e-3);
  EXPECT_EQ(model.asked_utime, 3 * kFrame_us);
  tracker.use_motion_model(nullptr);
  EXPECT_FALSE(tracker.track(*shown.frame).ok);
}

// As of wheels: they measure the way ahead. The prior is 4 mm off, less than the gate of any match.
TEST_F(TrackerTest, APriorPullsThePoseByItsInformation) {
  start();
  track_and_accept(1);
  const SE3 off = drive(2).boxplus((Vector6d() << 0.004, 0, 0, 0, 0, 0).finished());
  FixedMotion model;
  model.prior.T_world_body = off;
  tracker.use_motion_model(&model);
  const TrackOutcome by_images = track(2);
  ASSERT_TRUE(by_images.ok);
  EXPECT_LT(error_of(by_images.T_world_body, drive(2)), 2e-4);
  // As certain as the images: half way.
  model.prior.information = by_images.covariance.inverse();
  const TrackOutcome half_way = tracker.track(*shown.frame);
  ASSERT_TRUE(half_way.ok);
  EXPECT_NEAR(by_images.T_world_body.boxminus_to(half_way.T_world_body)[0], 0.002, 2e-4);
  EXPECT_LT(half_way.covariance(0, 0), 0.6 * by_images.covariance(0, 0));
  // Far more certain along x, and only there.
  model.prior.information.setZero();
  model.prior.information(0, 0) = 1e4 / by_images.covariance(0, 0);
  const TrackOutcome pulled = tracker.track(*shown.frame);
  ASSERT_TRUE(pulled.ok);
  EXPECT_NEAR(drive(2).boxminus_to(pulled.T_world_body)[0], 0.004, 1e-4);
  EXPECT_LT(drive(2).boxminus_to(pulled.T_world_body).tail<3>().norm(), 1e-3);
}

// The turn of each frame is wider than the window around the last pose, not around the prior.
TEST_F(TrackerTest, LooksWhereTheVelocityLeads) {
  scene.config.tracking.prior_search_px = 4;  // 16 px at most
  for (ScenePoint& p : scene.points) p.host_level = 0;
  Tracker narrow(scene.config);
  narrow.start(SE3{}, 0);
  narrow.set_view(scene.view());
  const auto turned = [](double rad) { return TrackingScene::pose({0, 0, 0}, {0, 0, rad}); };
  for (const int n : {1, 2, 3, 4}) {
    const double rad = 0.0085 * n * (n + 1);  // steps of 7, 14, 21, 28 px
    shown = scene.look(turned(rad), n * kFrame_us);
    const TrackOutcome out = narrow.track(*shown.frame);
    ASSERT_TRUE(out.ok) << n;
    narrow.accept(*shown.frame, out);
  }
}

// Most of the view moved together by 8 px, which gives another pose with more matches.
TEST_F(TrackerTest, BelievesTheLastFramesLandmarksBeforeTheWholeView) {
  start();
  for (ScenePoint& p : scene.points) p.visible = p.in_reference;
  track_and_accept(1);
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    scene.points[i].visible = i % 4 == 0 || !scene.points[i].in_reference;
    if (!scene.points[i].in_reference)
      scene.points[i].corner_offset_px = scene.points[i].alignment_offset_px = {8, 0};
  }
  const TrackOutcome out = track(2);
  ASSERT_TRUE(out.ok);
  EXPECT_LT(error_of(out.T_world_body, drive(2)), 2e-3);
}

TEST_F(TrackerTest, SaysWhenItsMatchesContradictThePose) {
  start();
  EXPECT_TRUE(track(1).agreed());
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    if (i % 5 < 3) continue;  // 60 % agree
    const double angle_rad = scene.uniform(0, 2 * M_PI);
    scene.points[i].alignment_offset_px = 1.9 * Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad));
  }
  const TrackOutcome out = track(1);
  EXPECT_TRUE(out.ok);
  EXPECT_FALSE(out.agreed());
  std::vector<Sighting> sightings;
  tracker.sightings(&sightings);
  EXPECT_EQ(static_cast<int>(sightings.size()), out.inliers);
}

// --- what it hands to mapping
// --------------------------------------------------------------------------------------

TEST_F(TrackerTest, SightingsNameLandmarkFeatureAndPixel) {
  for (ScenePoint& p : scene.points) p.corner_offset_px = {0.5, -0.7};
  start();
  const TrackOutcome out = track_and_accept(1);
  std::vector<Sighting> sightings;
  tracker.sightings(&sightings);
  ASSERT_EQ(static_cast<int>(sightings.size()), out.inliers);
  for (const Sighting& s : sightings) {
    const int point = shown.point_of_feature[static_cast<std::size_t>(s.feature)];
    ASSERT_GE(point, 0);
    EXPECT_EQ(s.landmark, scene.points[static_cast<std::size_t>(point)].handle);
    const Feature& f = shown.frame->views[0].set.features[static_cast<std::size_t>(s.feature)];
    EXPECT_LT((s.pixel - Eigen::Vector2f(f.u_px - 0.5F, f.v_px + 0.7F)).norm(), 1e-3F);
    EXPECT_FLOAT_EQ(s.sigma_px, std::hypot(0.1F, 0.5F));
  }
  std::vector<LandmarkHandle> seen;
  tracker.last_seen(&seen);
  ASSERT_EQ(seen.size(), sightings.size());
  for (std::size_t i = 0; i < seen.size(); ++i) EXPECT_EQ(seen[i], sightings[i].landmark);
}

TEST_F(TrackerTest, CountsWhatShouldHaveBeenSeenAndWhatWas) {
  scene.points[10].visible = false;
  start();
  for (const int n : {1, 2, 3}) track_and_accept(n);
  (void)track(4);  // not accepted, not counted
  std::vector<SightingCount> counts;
  tracker.take_counts(&counts);
  const auto count_of = [&](std::size_t point) {
    const auto c = std::find_if(counts.begin(), counts.end(), [&](const SightingCount& s) {
      return s.landmark == scene.points[point].handle;
    });
    return c != counts.end() ? std::pair<int, int>{c->visible, c->found} : std::pair<int, int>{-1, -1};
  };
  std::size_t middle = 0;  // a point that stays in the image
  while (shown.feature_of_point[middle] < 0 || middle == 10) ++middle;
  EXPECT_EQ(count_of(middle), (std::pair<int, int>{3, 3}));
  EXPECT_EQ(count_of(10), (std::pair<int, int>{3, 0}));
  tracker.take_counts(&counts);
  EXPECT_TRUE(counts.empty());
}

TEST(SightingCounter, ALandmarkThatTakesOverASlotBeginsAtZero) {
  SightingCounter counter(10);
  std::vector<SightingCount> counts;
  counter.add_visible({3, 1});
  counter.add_visible({7, 1});
  counter.add_visible({3, 2});
  counter.add_found({3, 2});
  counter.take(&counts);
  ASSERT_EQ(counts.size(), 2U);
  EXPECT_EQ(counts[0].landmark, (LandmarkHandle{3, 2}));
  EXPECT_EQ(counts[0].visible, 1);
  EXPECT_EQ(counts[0].found, 1);
  EXPECT_EQ(counts[1].landmark, (LandmarkHandle{7, 1}));
  EXPECT_EQ(counts[1].found, 0);
  counter.add_visible({3, 2});
  counter.clear();
  counter.take(&counts);
  EXPECT_TRUE(counts.empty());
}

// --- newer views
// ---------------------------------------------------------------------------------------------------

TEST_F(TrackerTest, FollowsItsKeyframeIntoANewerView) {
  start();
  for (const int n : {1, 2}) track_and_accept(n);
  // Mapping moved the whole map: far outside any window around the old prior.
  const SE3 moved = TrackingScene::pose({3, -2, 1}, {0.1, 0.2, 0.9});
  for (ScenePoint& p : scene.points) p.position_w = moved * p.position_w;
  scene.T_world_reference = moved * scene.T_world_reference;
  tracker.set_view(scene.view());
  EXPECT_LT(error_of(tracker.T_world_body(), moved * drive(2)), 1e-3);
  shown = scene.look(moved * drive(3), 3 * kFrame_us);
  const TrackOutcome out = tracker.track(*shown.frame);
  ASSERT_TRUE(out.ok);
  EXPECT_LT(error_of(out.T_world_body, moved * drive(3)), 1e-3);
}

// Another unit and other axes between two frames. Without a lever arm: it would not change its length.
TEST_F(TrackerTest, FollowsAMapThatIsDoubledAndTurnedBetweenTwoFrames) {
  scene.rig.cameras[0].T_body_camera.t.setZero();
  start();
  for (const int n : {1, 2, 3}) track_and_accept(n);
  const Vector6d velocity = tracker.velocity_body();
  const Sim3 S{2.0, so3_exp({0.1, 0.2, 0.9}), {3, -2, 1}};
  for (ScenePoint& p : scene.points) p.position_w = S * p.position_w;
  scene.T_world_reference = S * scene.T_world_reference;
  const auto view = scene.view();
  view->reference_scale = 2.0;
  view->keyframes = {{3, S * TrackingScene::pose({-2, 0, 0}), 2.0}, {7, scene.T_world_reference, 2.0}};
  EXPECT_EQ(tracker.set_view(view), 2.0);
  EXPECT_LT(error_of(tracker.T_world_body(), S * drive(3)), 2e-3);
  EXPECT_LT((tracker.velocity_body().head<3>() - 2.0 * velocity.head<3>()).norm(), 1e-12);
  // The prior hits: the first attempt finds the landmarks that the last frame saw, in the smallest window.
  scene.add_doubles();
  tracker.set_view(view);
  for (const int n : {4, 5, 6}) {
    shown = scene.look(S * drive(n), n * kFrame_us);
    const TrackOutcome out = tracker.track(*shown.frame);
    ASSERT_TRUE(out.ok) << n;
    EXPECT_LT(error_of(out.T_world_body, S * drive(n)), 2e-3) << n;
    EXPECT_GT(out.inliers, 150) << n;
    tracker.accept(*shown.frame, out);
  }
  const Vector6d expected = drive(5).boxminus_to(drive(6)) * 10.0;
  EXPECT_LT((tracker.velocity_body().head<3>() - 2.0 * expected.head<3>()).norm(), 0.04);
  EXPECT_LT((tracker.velocity_body().tail<3>() - expected.tail<3>()).norm(), 0.02);
}

TEST_F(TrackerTest, PosesFramesOfAnotherTrackerWithoutMovingItself) {
  start();
  track_and_accept(1);
  std::vector<LandmarkHandle> seen;
  tracker.last_seen(&seen);
  Tracker other(scene.config);
  other.adopt(tracker.shared_view(), seen);
  const SceneFrame frame = scene.look(drive(4), 0);
  const TrackOutcome out = other.track_from(*frame.frame, drive(3));
  EXPECT_TRUE(out.ok);
  EXPECT_LT(error_of(out.T_world_body, drive(4)), 1e-3);
  EXPECT_EQ(error_of(other.T_world_body(), SE3{}), 0.0);
  other.adopt(nullptr, {});
  EXPECT_EQ(other.view(), nullptr);
}

// --- after a loss
// --------------------------------------------------------------------------------------------------

class TrackerTrialTest : public TrackerTest {
 protected:
  void accept_wrong_trial() {
    start();
    for (const int n : {1, 2}) track_and_accept(n);
    TrackOutcome wrong;
    wrong.ok = true;
    wrong.T_world_body = TrackingScene::pose({20, 5, 0}, {0, 0, 2});
    shown = scene.look(TrackingScene::pose({20, 5, 0}, {0, 0, 2}), 3 * kFrame_us);
    tracker.accept_on_trial(*shown.frame, wrong);
  }
};

TEST_F(TrackerTrialTest, SearchesFromTheConfirmedPoseAndNotFromTheOneOnTrial) {
  scene.add_doubles();
  accept_wrong_trial();
  EXPECT_LT(error_of(tracker.T_world_body(), TrackingScene::pose({20, 5, 0}, {0, 0, 2})), 1e-9);
  shown = scene.look(drive(4), 4 * kFrame_us);
  const TrackOutcome out = tracker.relocalise(*shown.frame);
  ASSERT_TRUE(out.ok);
  EXPECT_LT(error_of(out.T_world_body, drive(4)), 1e-3);
}

// What the trial saw has moved together since, which gives another pose with more matches.
TEST_F(TrackerTrialTest, BelievesTheLandmarksOfTheConfirmedFrameAndNotThoseOfTheTrial) {
  const auto show = [this](bool confirmed_ones, bool others) {
    for (std::size_t i = 0; i < scene.points.size(); ++i) {
      scene.points[i].in_reference = false;
      scene.points[i].visible = i % 3 == 0 ? confirmed_ones : others;
    }
  };
  show(true, false);
  start();
  for (const int n : {1, 2}) track_and_accept(n);
  show(false, true);
  const TrackOutcome trial = track(3);
  ASSERT_TRUE(trial.ok);
  tracker.accept_on_trial(*shown.frame, trial);
  show(true, true);
  for (std::size_t i = 0; i < scene.points.size(); ++i)
    if (i % 3 != 0) scene.points[i].position_w += Eigen::Vector3d(0, 0.6, 0.3);
  shown = scene.look(drive(4), 4 * kFrame_us);
  const TrackOutcome out = tracker.relocalise(*shown.frame);
  ASSERT_TRUE(out.ok);
  EXPECT_LT(error_of(out.T_world_body, drive(4)), 5e-3);
}

TEST_F(TrackerTrialTest, TheNextFrameGoesOnFromThePoseOnTrial) {
  start();
  for (const int n : {1, 2}) track_and_accept(n);
  shown = scene.look(drive(6), 6 * kFrame_us);
  const TrackOutcome found = tracker.relocalise(*shown.frame);
  ASSERT_TRUE(found.ok);
  tracker.accept_on_trial(*shown.frame, found);
  const Vector6d expected = drive(2).boxminus_to(drive(6)) / 0.4;
  EXPECT_LT((tracker.velocity_body() - expected).norm(), 0.02);
  EXPECT_LT(error_of(track_and_accept(7).T_world_body, drive(7)), 1e-3);
}

// --- the heap
// ------------------------------------------------------------------------------------------------------

TEST_F(TrackerTest, AllocatesNothing) {
  if (!farpoint::test::counts_allocations()) GTEST_SKIP() << "a sanitizer owns the heap";
  start();
  std::vector<SceneFrame> frames;
  for (int n = 1; n <= 6; ++n) frames.push_back(scene.look(drive(n), n * kFrame_us));
  std::vector<std::shared_ptr<const LocalView>> views;
  views.reserve(6);
  for (int n = 0; n < 6; ++n) views.push_back(scene.view());
  std::vector<Sighting> sightings;
  std::vector<SightingCount> counts;
  sightings.reserve(1000), counts.reserve(1000);
  const auto before = farpoint::test::allocations();
  bool ok = true;
  for (std::size_t n = 0; n < frames.size(); ++n) {
    tracker.set_view(views[n]);
    const Frame& frame = *frames[n].frame;
    const TrackOutcome out = n == 3 ? tracker.relocalise(frame) : tracker.track(frame);
    ok = ok && out.ok;
    if (n == 3)
      tracker.accept_on_trial(frame, out);
    else
      tracker.accept(frame, out);
    tracker.sightings(&sightings);
    tracker.take_counts(&counts);
  }
  const auto after = farpoint::test::allocations();
  EXPECT_TRUE(ok);
  EXPECT_EQ(after - before, 0U);
  EXPECT_GT(before, 0U);  // the count works
}

}  // namespace
}  // namespace farpoint::slam
