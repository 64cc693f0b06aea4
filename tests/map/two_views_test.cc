// SPDX-License-Identifier: Apache-2.0
// A keyframe of two cameras: a landmark may be seen by both.
#include <gtest/gtest.h>

#include <vector>

#include "tests/map/map_harness.h"

namespace farpoint::slam {
namespace {

class TwoViews : public MapTest {
 protected:
  // Both cameras gave an image.
  KeyframeHandle stereo_keyframe() {
    Keyframe k = map.new_keyframe();
    k.T_world_body = random_pose(&random);
    for (const int c : {0, 1})
      k.views[c] = make_view(rig.cameras[static_cast<std::size_t>(c)].camera, kFeatures, &random);
    return map.add_keyframe(std::move(k));
  }
  // Seen by each of `observers` at the feature of that number; the first is the host.
  LandmarkHandle landmark_of(const std::vector<Observer>& observers, std::size_t feature) {
    const LandmarkHandle h = map.add_landmark(observers[0].keyframe, observers[0].camera, feature);
    EXPECT_FALSE(h.is_null());
    map.landmarks()[h].state = LandmarkState::kFull;
    map.landmarks()[h].inverse_depth = 0.1;
    for (std::size_t i = 1; i < observers.size(); ++i)
      EXPECT_TRUE(map.add_observation(h, sighting(map, observers[i].keyframe, feature, observers[i].camera)));
    return h;
  }

  const KeyframeHandle a = stereo_keyframe(), b = stereo_keyframe(), c = stereo_keyframe();
};

TEST_F(TwoViews, ALandmarkIsSeenOnceByEachCamera) {
  const LandmarkHandle h = landmark_of({{a, 0}, {a, 1}}, 3);
  EXPECT_EQ(map.keyframes()[a].views[0].landmarks[3], h);
  EXPECT_EQ(map.keyframes()[a].views[1].landmarks[3], h);
  EXPECT_FALSE(map.add_observation(h, sighting(map, a, 7, 1))) << "that camera sees it already";
  EXPECT_EQ(Map::find_observation(map.landmarks()[h], a)->camera, 0);
  EXPECT_EQ(Map::find_observation(map.landmarks()[h], a, 1)->feature, 3);
  EXPECT_EQ(Map::find_observation(map.landmarks()[h], b, 1), nullptr);
  check(map, capacity);
}

TEST_F(TwoViews, ObservationsComeByKeyframeAndThenByCamera) {
  const LandmarkHandle h = landmark_of({{b, 1}, {c, 0}, {a, 1}, {b, 0}, {a, 0}}, 2);
  std::vector<std::pair<std::uint64_t, int>> order;
  for (const Observation& o : map.landmarks()[h].observations)
    order.emplace_back(map.keyframes()[o.keyframe].id, o.camera);
  EXPECT_EQ(order, (std::vector<std::pair<std::uint64_t, int>>{{1, 0}, {1, 1}, {2, 0}, {2, 1}, {3, 0}}));
  check(map, capacity);
}

TEST_F(TwoViews, ALandmarkHostedByTheSecondCameraIsAnchoredThere) {
  const LandmarkHandle h = landmark_of({{a, 1}, {b, 0}}, 5);
  const Landmark& l = map.landmarks()[h];
  EXPECT_EQ(l.host_camera, 1);
  expect_same_pose(map.T_world_anchor(l), map.keyframes()[a].T_world_body * rig.cameras[1].T_body_camera);
  expect_same_pose(map.T_world_camera(map.keyframes()[a], 1), map.T_world_anchor(l));
}

TEST_F(TwoViews, TwoCamerasOfOneKeyframeGiveParallax) {
  const LandmarkHandle h = landmark_of({{a, 0}, {a, 1}}, 3);
  const Landmark& l = map.landmarks()[h];
  EXPECT_GT(l.max_parallax_rad, 0.0);
  EXPECT_EQ(l.parallax_keyframe, a);
  EXPECT_EQ(l.parallax_camera, 1);
  EXPECT_DOUBLE_EQ(l.max_parallax_rad, map.parallax(l, *Map::find_observation(l, a, 1)));
}

TEST_F(TwoViews, TheBestPairIsSearchedAnewWhenItsCameraGoes) {
  const LandmarkHandle h = landmark_of({{a, 0}, {a, 1}, {b, 0}, {b, 1}}, 3);
  const Landmark& l = map.landmarks()[h];
  while (l.observations.size() > 2) {
    const double was = l.max_parallax_rad;
    ASSERT_TRUE(map.remove_observation(h, l.parallax_keyframe, l.parallax_camera));
    EXPECT_LT(l.max_parallax_rad, was);
    check(map, capacity);
    ASSERT_FALSE(HasFailure());
  }
}

TEST_F(TwoViews, SharedLandmarksCountOnceAPairOfKeyframes) {
  landmark_of({{a, 0}, {a, 1}, {b, 0}, {b, 1}}, 0);
  landmark_of({{a, 1}, {b, 0}, {b, 1}}, 1);
  landmark_of({{a, 0}, {a, 1}, {c, 1}}, 2);
  map.update_covisibility(a);
  const auto& list = map.keyframes()[a].covisible;
  ASSERT_EQ(list.size(), 2U);
  EXPECT_EQ(list[0].keyframe, b);
  EXPECT_EQ(list[0].shared, 2);
  EXPECT_EQ(list[1].keyframe, c);
  EXPECT_EQ(list[1].shared, 1);
  check(map, capacity);
}

TEST_F(TwoViews, TheHostStaysWhileOneOfItsCamerasSeesTheLandmark) {
  const LandmarkHandle h = landmark_of({{b, 0}, {b, 1}, {a, 0}}, 4);
  const Eigen::Vector4d point = map.world_point(map.landmarks()[h]);
  ASSERT_TRUE(map.remove_observation(h, b, 0));
  EXPECT_EQ(map.landmarks()[h].host, b) << "not the first observer";
  EXPECT_LT((map.world_point(map.landmarks()[h]) - point).norm(), 1e-12);
  EXPECT_TRUE(map.keyframes()[b].views[0].landmarks[4].is_null());
  EXPECT_EQ(map.keyframes()[b].views[1].landmarks[4], h);
  check(map, capacity);
}

TEST_F(TwoViews, RemovingAKeyframeTakesBothSightingsAndRehosts) {
  const LandmarkHandle h = landmark_of({{a, 0}, {a, 1}, {b, 0}, {c, 1}}, 4);
  const LandmarkHandle only_here = landmark_of({{a, 0}, {a, 1}, {c, 0}}, 9);
  const Eigen::Vector4d point = map.world_point(map.landmarks()[h]);
  map.remove_keyframe(a);
  ASSERT_TRUE(map.landmarks().contains(h));
  EXPECT_FALSE(map.landmarks().contains(only_here)) << "one observation is left";
  EXPECT_EQ(map.landmarks()[h].observations.size(), 2U);
  EXPECT_EQ(map.landmarks()[h].host, b);
  EXPECT_LT((map.world_point(map.landmarks()[h]) - point).norm(), 1e-9);
  check(map, capacity);
}

TEST_F(TwoViews, ThinningRenumbersTheFeaturesOfBothCameras) {
  landmark_of({{a, 1}, {b, 1}}, 1);
  const LandmarkHandle h = landmark_of({{a, 0}, {a, 1}, {b, 0}}, 30);
  map.thin_keyframe(a);
  const Keyframe& k = map.keyframes()[a];
  EXPECT_FALSE(k.has_pixels());
  EXPECT_EQ(k.views[0].landmarks.size(), 1U);
  EXPECT_EQ(k.views[1].landmarks.size(), 2U);
  EXPECT_EQ(Map::find_observation(map.landmarks()[h], a, 0)->feature, 0);
  EXPECT_EQ(Map::find_observation(map.landmarks()[h], a, 1)->feature, 1);
  check(map, capacity);
}

TEST_F(TwoViews, ACameraWithoutAnImageSeesNothing) {
  const KeyframeHandle one = keyframe(1);
  const LandmarkHandle h = landmark_of({{a, 0}, {a, 1}}, 0);
  EXPECT_FALSE(map.add_observation(h, sighting(map, one, 0, 0)));
  EXPECT_TRUE(map.add_observation(h, sighting(map, one, 0, 1)));
  map.thin_keyframe(one);
  map.remove_keyframe(one);
  check(map, capacity);
}

TEST_F(TwoViews, ARefinedCalibrationConcernsItsCameraOnly) {
  const LandmarkHandle first = landmark_of({{a, 0}, {b, 0}}, 0), second = landmark_of({{a, 1}, {b, 1}}, 0);
  const Eigen::Vector3d f0 = map.landmarks()[first].bearing, f1 = map.landmarks()[second].bearing;
  const Eigen::Vector3f b0 = map.keyframes()[a].views[0].bearings[7],
                        b1 = map.keyframes()[a].views[1].bearings[7];
  Camera::Parameters p = rig.cameras[1].camera.parameters();
  p.fx_px *= 1.1, p.fy_px *= 1.1;
  map.set_camera(1, Camera(p));
  EXPECT_EQ(map.landmarks()[first].bearing, f0);
  EXPECT_NE(map.landmarks()[second].bearing, f1);
  EXPECT_EQ(map.keyframes()[a].views[0].bearings[7], b0);
  EXPECT_NE(map.keyframes()[a].views[1].bearings[7], b1);
}

}  // namespace
}  // namespace farpoint::slam
