// SPDX-License-Identifier: Apache-2.0
// A landmark stays where it is when its host changes.
#include <gtest/gtest.h>

#include <vector>

#include "tests/map/map_harness.h"

namespace farpoint::slam {
namespace {

struct Geometry {
  Eigen::Vector4d point;
  SE3 anchor;
};
Geometry geometry(const Map& map, LandmarkHandle h) {
  return {map.world_point(map.landmarks()[h]), map.T_world_anchor(map.landmarks()[h])};
}
void expect_unmoved(const Geometry& a, const Geometry& b) {
  EXPECT_LT((a.point - b.point).norm(), 1e-9);
  EXPECT_LT((a.anchor.t - b.anchor.t).norm(), 1e-9);
  EXPECT_LT((a.anchor.rotation() - b.anchor.rotation()).norm(), 1e-9);
}

TEST_F(MapTest, RehostMovesNothing) {
  const auto k = keyframes(4);
  std::size_t feature = 0;
  for (const double rho : {0.0, 1e-4, 0.2}) {
    const LandmarkHandle h = landmark(k, feature++, rho);
    const Geometry before = geometry(map, h);
    for (const int next : {2, 1, 3, 0, 2}) {
      map.rehost(h, k[static_cast<std::size_t>(next)]);
      EXPECT_EQ(map.landmarks()[h].host, k[static_cast<std::size_t>(next)]);
      expect_unmoved(before, geometry(map, h));
    }
    check(map, capacity);
  }
}

TEST_F(MapTest, RehostToAStrangerIsRefused) {
  const auto k = keyframes(3);
  const LandmarkHandle h = landmark({k[0], k[1]}, 0);
  map.rehost(h, k[2]);
  EXPECT_EQ(map.landmarks()[h].host, k[0]);
}

TEST_F(MapTest, ForgettingHostsMovesNothingAndKeepsTheLandmark) {
  const auto k = keyframes(8);
  const LandmarkHandle h = landmark({k[0], k[1], k[3], k[4], k[6], k[7]}, 0, 0.07);
  const Geometry before = geometry(map, h);
  const Eigen::Vector3d bearing = map.landmarks()[h].bearing;
  for (const std::size_t gone : {0, 1, 3, 4}) {
    EXPECT_EQ(map.landmarks()[h].host, k[gone]);
    map.remove_keyframe(k[gone]);
    ASSERT_TRUE(map.landmarks().contains(h));
    expect_unmoved(before, geometry(map, h));
    check(map, capacity);
  }
  EXPECT_EQ(map.landmarks()[h].bearing, bearing);
  EXPECT_EQ(map.landmarks()[h].inverse_depth, 0.07);
  EXPECT_EQ(map.landmarks()[h].host, k[6]);
  // The new host carries it: it moves with that keyframe, and only with it.
  const SE3 shift{so3_exp({0.1, 0, 0}), {1, 2, 3}};
  map.keyframes()[k[7]].T_world_body = shift * map.keyframes()[k[7]].T_world_body;
  expect_unmoved(before, geometry(map, h));
  map.keyframes()[k[6]].T_world_body = shift * map.keyframes()[k[6]].T_world_body;
  const Geometry after = geometry(map, h);
  EXPECT_LT(
      (after.point.head<3>() / after.point[3] - shift * (before.point.head<3>() / before.point[3])).norm(),
      1e-9);
}

}  // namespace
}  // namespace farpoint::slam
