// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/duplicates.h"

#include <gtest/gtest.h>

#include "tests/support/point_world.h"

namespace farpoint::slam {
namespace {

using test::MappedWorld;

// Five keyframes that share landmarks; the points from kFree on have none.
class DuplicatesTest : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kFree = 60;

  DuplicatesTest() : k(w.add_keyframes(5)), duplicates(w.config, &w.map, &w.counts) {
    w.add_landmarks(0, kFree, k);
    w.update_covisibility(k);
    point = w.free_point(k, kFree);
  }
  [[nodiscard]] const Landmark& landmark(LandmarkHandle h) const { return w.map.landmarks()[h]; }
  [[nodiscard]] bool sees(KeyframeHandle keyframe, LandmarkHandle h) const {
    return w.landmark_at(keyframe, point) == h && Map::find_observation(landmark(h), keyframe) != nullptr;
  }

  MappedWorld w;
  std::vector<KeyframeHandle> k;
  Duplicates duplicates;
  std::uint32_t point = 0;
};

TEST_F(DuplicatesTest, NeighboursLandmarkIsFoundOnAFreeCorner) {
  const LandmarkHandle h = w.add_landmark(point, {k[0], k[1]});
  duplicates.search_neighbours_landmarks(k[4]);
  ASSERT_TRUE(sees(k[4], h));
  const Observation* o = Map::find_observation(landmark(h), k[4]);
  EXPECT_GT(o->sigma_px, 0.0F);
  EXPECT_EQ(landmark(h).observations.size(), 3U);
  EXPECT_EQ(w.counts.landmarks_fused, 0U);
}

TEST_F(DuplicatesTest, OwnLandmarkIsFoundInTheNeighbours) {
  const LandmarkHandle h = w.add_landmark(point, {k[4], k[3]});
  duplicates.search_neighbours_landmarks(k[4]);
  EXPECT_EQ(landmark(h).observations.size(), 2U);
  duplicates.fuse_neighbourhood(k[4]);
  for (const KeyframeHandle& keyframe : k) EXPECT_TRUE(sees(keyframe, h));
}

TEST_F(DuplicatesTest, LandmarkWithMoreSightingsTakesTheOtherIn) {
  const LandmarkHandle more = w.add_landmark(point, {k[0], k[1], k[2]});
  const LandmarkHandle fewer = w.add_landmark(point, {k[3], k[4]});
  w.map.landmarks()[more].found = 5, w.map.landmarks()[more].visible = 6;
  w.map.landmarks()[fewer].found = 3, w.map.landmarks()[fewer].visible = 4;
  duplicates.search_into(k[4], {more});
  EXPECT_FALSE(w.map.landmarks().contains(fewer));
  ASSERT_TRUE(w.map.landmarks().contains(more));
  for (const KeyframeHandle& keyframe : k) EXPECT_TRUE(sees(keyframe, more));
  EXPECT_EQ(landmark(more).found, 8U);
  EXPECT_EQ(landmark(more).visible, 10U);
  EXPECT_EQ(w.counts.landmarks_fused, 1U);
}

TEST_F(DuplicatesTest, SearchedLandmarkWithFewerSightingsIsTakenIn) {
  const LandmarkHandle more = w.add_landmark(point, {k[0], k[1], k[2]});
  const LandmarkHandle fewer = w.add_landmark(point, {k[3], k[4]});
  duplicates.search_into(k[1], {fewer});
  EXPECT_FALSE(w.map.landmarks().contains(fewer));
  ASSERT_TRUE(w.map.landmarks().contains(more));
  EXPECT_EQ(landmark(more).observations.size(), 5U);
}

TEST_F(DuplicatesTest, FusedSightingsAreMeasuredWithThePatchThatStays) {
  const LandmarkHandle into = w.add_landmark(point, {k[0], k[1], k[2]});
  const LandmarkHandle from = w.add_landmark(point, {k[3], k[4]});
  w.image(k[4]).hide(point);
  const Eigen::Vector2f shift(0.5F, -0.25F);
  const Eigen::Vector2f before = Map::find_observation(landmark(from), k[3])->pixel;
  w.image(k[3]).displace(point, shift);
  duplicates.fuse(into, from);
  // The host's sighting of `from` had no error; it has one as a measurement.
  ASSERT_TRUE(sees(k[3], into));
  EXPECT_GT(Map::find_observation(landmark(into), k[3])->sigma_px, 0.0F);
  EXPECT_LT((Map::find_observation(landmark(into), k[3])->pixel - before - shift).norm(), 1e-3F);
  // A patch that is not found leaves the corner free.
  EXPECT_EQ(Map::find_observation(landmark(into), k[4]), nullptr);
  EXPECT_TRUE(w.landmark_at(k[4], point).is_null());
}

TEST_F(DuplicatesTest, VirtualPointOnTheCornerGivesWay) {
  const LandmarkHandle h = w.add_landmark(point, {k[0], k[1]});
  const LandmarkHandle virtual_point = w.add_landmark(point, {k[2], k[3], k[4]});
  w.map.landmarks()[virtual_point].state = LandmarkState::kBearing;
  duplicates.search_into(k[4], {h});
  EXPECT_FALSE(w.map.landmarks().contains(virtual_point));
  EXPECT_TRUE(sees(k[4], h));
  EXPECT_TRUE(w.landmark_at(k[3], point).is_null());
}

TEST_F(DuplicatesTest, VirtualPointStaysWhereThePatchIsNotFound) {
  const LandmarkHandle h = w.add_landmark(point, {k[0], k[1]});
  const LandmarkHandle virtual_point = w.add_landmark(point, {k[3], k[4]});
  w.map.landmarks()[virtual_point].state = LandmarkState::kBearing;
  w.image(k[4]).hide(point);
  duplicates.search_into(k[4], {h});
  EXPECT_TRUE(w.map.landmarks().contains(virtual_point));
  EXPECT_EQ(landmark(h).observations.size(), 2U);
}

TEST_F(DuplicatesTest, VirtualPointsAreNotSearched) {
  const LandmarkHandle h = w.add_landmark(point, {k[0], k[1]});
  w.map.landmarks()[h].state = LandmarkState::kBearing;
  duplicates.search_into(k[4], {h});
  EXPECT_EQ(landmark(h).observations.size(), 2U);
}

TEST_F(DuplicatesTest, LandmarkInAnotherPlaceIsNotTheSame) {
  const LandmarkHandle h = w.add_landmark(point, {k[0], k[1]});
  w.map.landmarks()[h].inverse_depth *= 4.0;
  duplicates.search_into(k[4], {h});
  EXPECT_EQ(landmark(h).observations.size(), 2U);
}

TEST_F(DuplicatesTest, ThinnedKeyframesAreSkipped) {
  const LandmarkHandle h = w.add_landmark(point, {k[0], k[1]});
  w.map.thin_keyframe(k[4]);
  duplicates.search_into(k[4], {h});
  EXPECT_EQ(landmark(h).observations.size(), 2U);
}

TEST_F(DuplicatesTest, RemovedLandmarksAreSkipped) {
  const LandmarkHandle h = w.add_landmark(point, {k[0], k[1]});
  const std::size_t landmarks = w.map.landmarks().size();
  w.map.remove_landmark(h);
  duplicates.search_into(k[4], {h});
  EXPECT_TRUE(w.landmark_at(k[4], point).is_null());
  EXPECT_EQ(w.map.landmarks().size(), landmarks - 1);
}

TEST_F(DuplicatesTest, SearchFollowsAMovedKeyframe) {
  const LandmarkHandle h = w.add_landmark(point, {k[0], k[1]});
  duplicates.search_into(k[3], {h});
  ASSERT_TRUE(sees(k[3], h));
  // Its host elsewhere, the landmark is elsewhere: an anchor kept from the last search would still find it.
  w.map.keyframes()[k[0]].T_world_body.t += Eigen::Vector3d(0.0, 1.5, 0.0);
  duplicates.search_into(k[4], {h});
  EXPECT_EQ(Map::find_observation(landmark(h), k[4]), nullptr);
}

}  // namespace
}  // namespace farpoint::slam
