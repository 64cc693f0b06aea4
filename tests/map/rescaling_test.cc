// SPDX-License-Identifier: Apache-2.0
// A map that gets another origin, other axes and another unit, whole or keyframe by keyframe.
#include <gtest/gtest.h>

#include <vector>

#include "tests/map/map_harness.h"

namespace farpoint::slam {
namespace {

class Rescaling : public MapTest {
 protected:
  struct Stand {
    Eigen::Vector3d point_w;
    SE3 T_world_anchor;
    double depth, relative_sigma;
  };
  [[nodiscard]] Stand stand(LandmarkHandle h) const {
    const Landmark& l = map.landmarks()[h];
    const Eigen::Vector4d p = map.world_point(l);
    return {p.head<3>() / p[3], map.T_world_anchor(l), 1.0 / l.inverse_depth,
            l.inverse_depth_sigma / l.inverse_depth};
  }
  void expect_moved(const Stand& was, LandmarkHandle h) const {
    const Stand is = stand(h);
    EXPECT_LT((is.point_w - S * was.point_w).norm(), 1e-9);
    expect_same_pose(is.T_world_anchor, S * was.T_world_anchor);
    EXPECT_NEAR(is.depth, S.scale * was.depth, 1e-9);
    EXPECT_NEAR(is.relative_sigma, was.relative_sigma, 1e-12);
  }

  const Sim3 S{2.0, so3_exp({0.2, -0.3, 1.1}), {4, -7, 2}};
};

TEST_F(Rescaling, EveryKeyframeAndLandmarkOfTheMapMoves) {
  const std::vector<KeyframeHandle> k = keyframes(4);
  std::vector<LandmarkHandle> l;
  for (std::size_t i = 0; i < 8; ++i) {
    l.push_back(
        landmark({k[i % 4], k[(i + 1) % 4], k[(i + 2) % 4]}, i, 0.05 + 0.01 * static_cast<double>(i)));
    map.landmarks()[l.back()].inverse_depth_sigma = 0.003;
    map.landmarks()[l.back()].creation_depth = 5.0;
  }
  map.rehost(l[0], k[1]);  // its anchor is no camera of its host any more
  std::vector<Stand> was;
  std::vector<SE3> T;
  for (const LandmarkHandle h : l) was.push_back(stand(h));
  for (const KeyframeHandle h : k) T.push_back(map.keyframes()[h].T_world_body);
  map.transform(0, S);
  for (std::size_t i = 0; i < l.size(); ++i) expect_moved(was[i], l[i]);
  for (std::size_t i = 0; i < k.size(); ++i) {
    expect_same_pose(map.keyframes()[k[i]].T_world_body, S * T[i]);
    EXPECT_EQ(map.keyframes()[k[i]].scale, 2.0);
  }
  EXPECT_EQ(map.landmarks()[l[0]].creation_depth, 10.0);
  check(map, capacity);
}

TEST_F(Rescaling, AnotherMapStaysInItsUnit) {
  const KeyframeHandle a = keyframe(), b = keyframe();
  map.keyframes()[a].map_id = map.keyframes()[b].map_id = 4;
  const LandmarkHandle h = landmark({a, b}, 3);
  const Eigen::Vector3d point = stand(h).point_w;
  map.transform(5, S);
  EXPECT_EQ(stand(h).point_w, point);
  EXPECT_EQ(map.keyframes()[a].scale, 1.0);
}

TEST_F(Rescaling, ScalesMultiply) {
  const KeyframeHandle a = keyframe();
  map.transform(0, S);
  map.transform(0, S);
  EXPECT_EQ(map.keyframes()[a].scale, 4.0);
  const KeyframeHandle made_since = keyframe();
  EXPECT_EQ(map.keyframes()[made_since].scale, 1.0);
}

TEST_F(Rescaling, AKeyframeTakesOnlyTheLandmarksThatItHosts) {
  const KeyframeHandle a = keyframe(), b = keyframe();
  const LandmarkHandle hosted = landmark({a, b}, 3), seen = landmark({b, a}, 4);
  const Stand was_hosted = stand(hosted), was_seen = stand(seen);
  map.correct_keyframe(a, S);
  expect_moved(was_hosted, hosted);
  EXPECT_EQ(stand(seen).point_w, was_seen.point_w);
  EXPECT_EQ(stand(seen).depth, was_seen.depth);
  EXPECT_EQ(map.keyframes()[b].scale, 1.0);
}

TEST_F(Rescaling, ALandmarkThatTwoCamerasOfItsHostSeeMovesOnce) {
  Keyframe k = map.new_keyframe();
  k.T_world_body = random_pose(&random);
  for (const int c : {0, 1})
    k.views[c] = make_view(rig.cameras[static_cast<std::size_t>(c)].camera, kFeatures, &random);
  const KeyframeHandle a = map.add_keyframe(std::move(k));
  const LandmarkHandle h = map.add_landmark(a, 1, 3);
  map.landmarks()[h].inverse_depth = 0.1;
  ASSERT_TRUE(map.add_observation(h, sighting(map, a, 5, 0)));
  const Stand was = stand(h);
  map.correct_keyframe(a, S);
  expect_moved(was, h);
}

TEST_F(Rescaling, RemovedKeyframesFollowWithThePosesRelativeToThem) {
  const KeyframeHandle a = keyframe(), b = keyframe();
  const std::uint64_t id = map.keyframes()[a].id;
  const SE3 T_a_frame{so3_exp({0, 0, 0.2}), {0.3, 0.1, 0}};
  const SE3 T_world_frame = map.keyframes()[a].T_world_body * T_a_frame;
  map.remove_keyframe(a);
  map.transform(0, S);
  Sim3 S_world_a;
  ASSERT_TRUE(map.similarity_of(id, &S_world_a));
  expect_same_pose(S_world_a * T_a_frame, S * T_world_frame);
  EXPECT_EQ(map.keyframes()[b].scale, 2.0);
}

}  // namespace
}  // namespace farpoint::slam
