// SPDX-License-Identifier: Apache-2.0
// Tracking with frames of two cameras.
#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "slam/tracking/initialiser.h"
#include "slam/tracking/tracker.h"
#include "tests/ipc/allocations.h"
#include "tests/support/tracking_scene.h"

namespace farpoint::slam {
namespace {

using test::error_of;
using test::kFrame_us;
using test::SceneFrame;
using test::TrackingScene;

// The second camera looks 0.2 rad further to the left, through another lens.
class TwoCameraTracking : public testing::Test {
 protected:
  TwoCameraTracking() {
    Camera::Parameters p = scene.rig.cameras[0].camera.parameters();
    p.fx_px = 380, p.fy_px = 390, p.cx_px = 310;
    const SE3 T_body_left =
        SE3{so3_exp({0.0, 0.0, 0.2}), {0.1, 0.5, 0.0}} * scene.rig.cameras[0].T_body_camera;
    scene.rig.cameras.push_back({"left", Camera(p), T_body_left});
  }
  void start() {
    tracker.start(scene.T_world_reference, 0);
    tracker.set_view(scene.view());
  }
  static SE3 drive(int n) { return TrackingScene::pose({0.1 * n, 0.01 * n, 0}, {0, 0, 0.01 * n}); }
  SceneFrame look_with_both(int n) {
    SceneFrame shown = scene.look(drive(n), n * kFrame_us);
    features_of_first = shown.frame->views[0].set.features.size();
    scene.show(drive(n), 1, &shown);
    return shown;
  }

  TrackingScene scene{300};
  Tracker tracker{scene.config, 2};
  std::size_t features_of_first = 0;
};

TEST_F(TwoCameraTracking, FollowsADriveWithMatchesOfBoth) {
  start();
  for (int n = 1; n <= 8; ++n) {
    const SceneFrame shown = look_with_both(n);
    const TrackOutcome out = tracker.track(*shown.frame);
    ASSERT_TRUE(out.ok) << n;
    EXPECT_LT(error_of(out.T_world_body, drive(n)), 1e-3) << n;
    EXPECT_GT(out.inliers, static_cast<int>(features_of_first)) << "more than one camera shows";
    tracker.accept(*shown.frame, out);
  }
}

TEST_F(TwoCameraTracking, FollowsADriveWithTheSecondAlone) {
  start();
  for (int n = 1; n <= 8; ++n) {
    const SceneFrame shown = scene.look(drive(n), n * kFrame_us, 1);
    const TrackOutcome out = tracker.track(*shown.frame);
    ASSERT_TRUE(out.ok) << n;
    EXPECT_LT(error_of(out.T_world_body, drive(n)), 1e-3) << n;
    tracker.accept(*shown.frame, out);
  }
}

TEST_F(TwoCameraTracking, ALandmarkIsMatchedOnceByEachCamera) {
  start();
  const SceneFrame shown = look_with_both(1);
  ASSERT_TRUE(tracker.track(*shown.frame).ok);
  std::vector<int> matched(2 * scene.points.size());
  int by_both = 0;
  for (const Match& m : tracker.matches()) {
    ++matched[m.camera * scene.points.size() + m.view_index];
    if (m.camera != 1) continue;
    by_both += matched[m.view_index];
    EXPECT_EQ(m.feature, shown.feature_of_point[m.view_index]) << "features of the second camera";
  }
  for (const int count : matched) EXPECT_LE(count, 1);
  EXPECT_GT(by_both, 100);
}

TEST_F(TwoCameraTracking, AMatchInOneCameraLeavesTheLandmarkFreeInTheOther) {
  SceneFrame shown = scene.look(scene.T_world_reference, kFrame_us);
  const std::vector<int> in_first = shown.feature_of_point;
  scene.show(scene.T_world_reference, 1, &shown);
  std::uint32_t point = 0;
  while (in_first[point] < 0 || shown.feature_of_point[point] < 0) ++point;
  Matcher matcher(scene.config, 2);
  matcher.set_view(scene.view());
  matcher.begin(*shown.frame);
  matcher.add(*shown.frame, point, 0, in_first[point]);
  matcher.project(*shown.frame, scene.T_world_reference, LandmarkSubset::kAll);
  matcher.match(*shown.frame, 10.0, 0.9F);
  std::vector<int> cameras;
  for (const Match& m : matcher.matches())
    if (m.view_index == point) cameras.push_back(m.camera);
  EXPECT_EQ(cameras, (std::vector{0, 1}));
}

TEST_F(TwoCameraTracking, SightingsNameTheirCamera) {
  start();
  const SceneFrame shown = look_with_both(1);
  const TrackOutcome out = tracker.track(*shown.frame);
  ASSERT_TRUE(out.ok);
  std::vector<Sighting> sightings;
  tracker.sightings(&sightings);
  ASSERT_EQ(sightings.size(), static_cast<std::size_t>(out.inliers));
  int of_second = 0;
  for (const Sighting& s : sightings) {
    const Feature& f = shown.frame->views[s.camera].set.features[static_cast<std::size_t>(s.feature)];
    EXPECT_LT((Eigen::Vector2f(f.u_px, f.v_px) - s.pixel).norm(), 1.0F);
    of_second += s.camera;
  }
  EXPECT_GT(of_second, 100);
}

TEST_F(TwoCameraTracking, FindsTheWayBackByTheSecondAlone) {
  start();
  const SceneFrame first = look_with_both(1);
  tracker.accept(*first.frame, tracker.track(*first.frame));
  const SceneFrame later = scene.look(drive(6), 20 * kFrame_us, 1);
  const TrackOutcome out = tracker.relocalise(*later.frame);
  ASSERT_TRUE(out.ok);
  EXPECT_LT(error_of(out.T_world_body, drive(6)), 1e-3);
}

TEST_F(TwoCameraTracking, MakesNoHeapCall) {
  start();
  const SceneFrame shown = look_with_both(1);
  const std::uint64_t before = farpoint::test::allocations();
  const TrackOutcome out = tracker.track(*shown.frame);
  tracker.accept(*shown.frame, out);
  EXPECT_EQ(farpoint::test::allocations(), before);
  EXPECT_TRUE(out.ok);
}

// A camera off the body's origin and turned: the pair's motion is the body's.
TEST_F(TwoCameraTracking, AMapStartsFromTheImagesOfEitherCamera) {
  for (const int camera : {0, 1}) {
    Initialiser initialiser(scene.config, scene.rig, camera);
    std::optional<InitialPair> pair;
    for (int n = 0; n < 20 && !pair; ++n) {
      const SE3 pose = TrackingScene::pose({0.05 * n, 0.25 * n, 0.0}, {0, 0, 0.01 * n});
      if (const InitialPair* found = initialiser.add(scene.look(pose, n * kFrame_us, camera).frame))
        pair = *found;
    }
    ASSERT_TRUE(pair.has_value()) << camera;
    EXPECT_EQ(pair->camera, camera);
    const std::int64_t frames = pair->second->utime / kFrame_us;
    const auto last = static_cast<double>(frames);
    EXPECT_LT((so3_log(pair->T_first_second.q) - Eigen::Vector3d(0, 0, 0.01 * last)).norm(), 1e-3) << camera;
  }
}

}  // namespace
}  // namespace farpoint::slam
