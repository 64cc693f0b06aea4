// SPDX-License-Identifier: Apache-2.0
#include "slam/map/map.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/map/map_harness.h"

namespace farpoint::slam {
namespace {

TEST_F(MapTest, KeyframesGetAscendingIdsAndFreeFeatures) {
  for (std::uint64_t i = 1; i <= 3; ++i) {
    const KeyframeHandle h = keyframe();
    EXPECT_EQ(map.keyframes()[h].id, i);
    EXPECT_EQ(view(h).landmarks.size(), static_cast<std::size_t>(kFeatures));
  }
  map.remove_keyframe(alive(map.keyframes())[1]);
  EXPECT_EQ(map.keyframes()[keyframe()].id, 4U);
}

TEST_F(MapTest, FullMapsGiveNullHandles) {
  while (!map.keyframes().full()) EXPECT_FALSE(keyframe().is_null());
  EXPECT_TRUE(keyframe().is_null());
  const auto all = alive(map.keyframes());
  int made = 0;
  for (const KeyframeHandle k : all)
    for (std::size_t f = 0; f < kFeatures && !map.landmarks().full(); ++f)
      made += add_landmark(&map, k, f).is_null() ? 0 : 1;
  EXPECT_EQ(made, capacity.landmarks);
  EXPECT_TRUE(add_landmark(&map, all.back(), kFeatures - 1).is_null());
  // Forgetting makes room again.
  map.remove_keyframe(all[0]);
  EXPECT_FALSE(keyframe().is_null());
  EXPECT_FALSE(add_landmark(&map, all.back(), kFeatures - 1).is_null());
}

TEST_F(MapTest, ALandmarkStartsAsItsFeature) {
  const KeyframeHandle k = keyframe(1);
  const LandmarkHandle h = add_landmark(&map, k, 3);
  ASSERT_FALSE(h.is_null());
  const Landmark& l = map.landmarks()[h];
  const Feature& f = view(k).set.features[3];
  EXPECT_EQ(l.state, LandmarkState::kBearing);
  EXPECT_EQ(l.host, k);
  EXPECT_EQ(l.descriptor, view(k).set.descriptors[3]);
  EXPECT_EQ(l.patch.pixels[0], 3);
  EXPECT_EQ(l.host_level, f.level);
  EXPECT_EQ(l.observations.size(), 1U);
  EXPECT_EQ(l.inverse_depth, 0.0);
  EXPECT_EQ(l.found, 1U);
  Eigen::Vector3d bearing, right, down;
  const Camera& camera = rig.cameras[1].camera;
  ASSERT_TRUE(camera.unproject({f.u_px, f.v_px}, &bearing));
  ASSERT_TRUE(camera.unproject({f.u_px + 1e-4, f.v_px}, &right));
  ASSERT_TRUE(camera.unproject({f.u_px, f.v_px + 1e-4}, &down));
  EXPECT_LT((l.bearing - bearing).norm(), 1e-6);
  EXPECT_LT((l.d_bearing_d_pixel.col(0) - (right - bearing) / 1e-4).norm(), 1e-6);
  EXPECT_LT((l.d_bearing_d_pixel.col(1) - (down - bearing) / 1e-4).norm(), 1e-6);
}

TEST_F(MapTest, ARecycledLandmarkRemembersNothing) {
  const auto k = keyframes(3);
  const LandmarkHandle old = landmark(k, 0);
  map.landmarks()[old].failures = 3;
  map.landmarks()[old].through_vmp = true;
  map.landmarks()[old].found = 99;
  map.remove_landmark(old);
  const LandmarkHandle h = add_landmark(&map, k[1], 5);
  EXPECT_EQ(h.index, old.index);
  const Landmark& l = map.landmarks()[h];
  EXPECT_EQ(l.failures, 0);
  EXPECT_FALSE(l.through_vmp);
  EXPECT_EQ(l.found, 1U);
  EXPECT_EQ(l.state, LandmarkState::kBearing);
  EXPECT_EQ(l.max_parallax_rad, 0.0);
  EXPECT_TRUE(l.parallax_keyframe.is_null());
  EXPECT_EQ(l.observations.size(), 1U);
  EXPECT_EQ(map.landmarks().get(old), nullptr);
}

TEST_F(MapTest, NoPatchNoLandmark) {
  const KeyframeHandle k = keyframe();
  view(k).set.features[2].level = FakeImage::kNoPatch;
  EXPECT_TRUE(add_landmark(&map, k, 2).is_null());
  view(k).image.reset();
  EXPECT_TRUE(add_landmark(&map, k, 3).is_null());
  EXPECT_EQ(map.landmarks().size(), 0U);
}

TEST_F(MapTest, RefusesSightingsThatCollide) {
  const auto k = keyframes(3);
  const LandmarkHandle a = landmark({k[0], k[1]}, 0), b = landmark({k[0]}, 1);
  EXPECT_FALSE(map.add_observation(a, sighting(map, k[1], 7)));  // sees it already
  EXPECT_FALSE(map.add_observation(b, sighting(map, k[1], 0)));  // the feature is a's
  Observation none = sighting(map, k[2], 0);
  none.feature = -1;
  EXPECT_FALSE(map.add_observation(a, none));
  none.feature = kFeatures;
  EXPECT_FALSE(map.add_observation(a, none));
  EXPECT_EQ(observers(a), (std::vector<std::uint64_t>{1, 2}));
  check(map, capacity);
}

TEST_F(MapTest, UnderTwoObserversALandmarkGoes) {
  const auto k = keyframes(3);
  const LandmarkHandle a = landmark({k[0], k[1], k[2]}, 0), b = landmark({k[0], k[1]}, 1);
  EXPECT_TRUE(remove_observation(a, k[2]));
  EXPECT_TRUE(remove_observation(a, k[2]));  // not there: nothing happens
  EXPECT_FALSE(remove_observation(a, k[1]));
  EXPECT_FALSE(map.landmarks().contains(a));
  EXPECT_TRUE(view(k[0]).landmarks[0].is_null());
  map.remove_keyframe(k[0]);
  EXPECT_FALSE(map.landmarks().contains(b));
  EXPECT_TRUE(view(k[1]).landmarks[1].is_null());
  check(map, capacity);
}

TEST_F(MapTest, TheLargestParallaxFollowsItsObservers) {
  const auto k = keyframes(5);
  const LandmarkHandle h = landmark(k, 0);
  while (map.landmarks()[h].observations.size() > 2) {
    const Landmark& l = map.landmarks()[h];
    const KeyframeHandle best = l.parallax_keyframe;
    const double was = l.max_parallax_rad;
    ASSERT_FALSE(best.is_null());
    ASSERT_TRUE(map.remove_observation(h, best, l.parallax_camera));
    EXPECT_LT(l.max_parallax_rad, was);
    EXPECT_NE(l.parallax_keyframe, best);
    check(map, capacity);
  }
}

TEST_F(MapTest, ThinningKeepsHostBestPairAndNewest) {
  const auto k = keyframes(14);
  const LandmarkHandle h = landmark({k[2]}, 0);
  for (const std::size_t i : {0, 1, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13}) {
    EXPECT_TRUE(map.add_observation(h, sighting(map, k[i], 0)));
    const Landmark& l = map.landmarks()[h];
    EXPECT_LE(l.observations.size(), 6U);
    EXPECT_NE(Map::find_observation(l, k[2]), nullptr) << "host lost";
    EXPECT_NE(Map::find_observation(l, l.parallax_keyframe), nullptr) << "best pair lost";
    EXPECT_NE(Map::find_observation(l, k[i]), nullptr) << "newest lost";
    check(map, capacity);
  }
  EXPECT_EQ(map.landmarks()[h].host, k[2]);
  EXPECT_EQ(map.landmarks()[h].observations.size(), 6U);
}

TEST_F(MapTest, AThinnedKeyframeKeepsWhatItsLandmarksNeed) {
  const auto k = keyframes(3);
  const LandmarkHandle high = landmark(k, 7), low = landmark({k[1], k[0]}, 2);
  const KeyframeView before = view(k[0]);
  map.thin_keyframe(k[0]);
  const KeyframeView& after = view(k[0]);
  check(map, capacity);
  ASSERT_EQ(after.landmarks, (std::vector{low, high}));
  EXPECT_EQ(Map::find_observation(map.landmarks()[high], k[0])->level, before.set.features[7].level);
  EXPECT_EQ(after.set.features.capacity() + after.set.descriptors.capacity() + after.bearings.capacity(), 0U);
  const KeyframeView next = map.preallocated_view();
  EXPECT_GE(next.set.features.capacity(), before.set.features.size());
  EXPECT_GE(next.bearings.capacity(), before.bearings.size());
  EXPECT_EQ(after.image, nullptr);
  // Its slots are those of landmarks: a freed one can take a sighting again.
  map.remove_landmark(low);
  EXPECT_TRUE(view(k[0]).landmarks[0].is_null());
  EXPECT_TRUE(add_landmark(&map, k[0], 0).is_null()) << "no pixels to cut a patch from";
  map.thin_keyframe(k[0]);  // once is enough
  EXPECT_EQ(view(k[0]).landmarks.size(), 2U);
}

TEST_F(MapTest, WorldPointLiesOnTheHostsRay) {
  const KeyframeHandle k = keyframe(1);
  const LandmarkHandle h = landmark({k}, 4, 0.25);
  const Eigen::Vector4d p = map.world_point(map.landmarks()[h]);
  const SE3 T_world_camera = map.keyframes()[k].T_world_body * rig.cameras[1].T_body_camera;
  EXPECT_LT((p.head<3>() / p[3] - T_world_camera * (4.0 * map.landmarks()[h].bearing)).norm(), 1e-12);
  // At infinity it is the ray's direction.
  map.landmarks()[h].inverse_depth = 0;
  const Eigen::Vector4d far = map.world_point(map.landmarks()[h]);
  EXPECT_EQ(far[3], 0.0);
  EXPECT_LT((far.head<3>() - T_world_camera.q * map.landmarks()[h].bearing).norm(), 1e-15);
}

TEST_F(MapTest, DiscardingOneMapLeavesTheOther) {
  std::vector<KeyframeHandle> first, second;
  for (int i = 0; i < 6; ++i) {
    Keyframe k = make_keyframe(rig, 0, random_pose(&random), kFeatures, &random);
    k.map_id = i % 2;
    (i % 2 == 0 ? first : second).push_back(map.add_keyframe(std::move(k)));
  }
  const LandmarkHandle a = landmark(first, 0), b = landmark(second, 0);
  map.discard_map(0);
  EXPECT_FALSE(map.landmarks().contains(a));
  EXPECT_TRUE(map.landmarks().contains(b));
  EXPECT_EQ(alive(map.keyframes()), second);
  SE3 T;
  EXPECT_FALSE(map.pose_of(1, &T));
  EXPECT_TRUE(map.pose_of(2, &T));
  check(map, capacity);
}

}  // namespace
}  // namespace farpoint::slam
