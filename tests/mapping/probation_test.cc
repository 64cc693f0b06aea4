// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/probation.h"

#include <gtest/gtest.h>

#include "tests/support/point_world.h"

namespace farpoint::slam {
namespace {

class ProbationTest : public ::testing::Test {
 protected:
  ProbationTest() : k(w.add_keyframes(4)), probation(&w.map, &w.counts) {}
  // A weak landmark made at the last of its observers.
  LandmarkHandle made_at(KeyframeHandle keyframe, const std::vector<KeyframeHandle>& observers) {
    const LandmarkHandle h = w.add_landmark(w.free_point(observers), observers);
    Landmark& l = w.map.landmarks()[h];
    l.state = LandmarkState::kWeak;
    l.created_keyframe = w.id(keyframe);
    l.visible = l.found = 10;
    return h;
  }

  test::MappedWorld w;
  std::vector<KeyframeHandle> k;
  Probation probation;
};

TEST_F(ProbationTest, AdmitsLandmarksWithADepthMadeAtTheKeyframe) {
  const LandmarkHandle admitted = made_at(k[1], {k[0], k[1]});
  made_at(k[0], {k[0], k[1]});
  w.map.landmarks()[made_at(k[1], {k[0], k[1]})].state = LandmarkState::kBearing;
  probation.admit_made_at(k[1]);
  EXPECT_EQ(probation.landmarks(), std::vector<LandmarkHandle>{admitted});
}

TEST_F(ProbationTest, RarelyFoundLandmarkGoes) {
  const LandmarkHandle rare = made_at(k[1], {k[0], k[1]}), found = made_at(k[1], {k[0], k[1]});
  w.map.landmarks()[rare].found = 2;
  w.map.landmarks()[found].found = 3;
  probation.admit_made_at(k[1]);
  probation.judge(w.id(k[1]) + 1);
  EXPECT_FALSE(w.map.landmarks().contains(rare));
  EXPECT_TRUE(w.map.landmarks().contains(found));
  EXPECT_EQ(w.counts.landmarks_culled, 1U);
}

TEST_F(ProbationTest, LandmarkThatNoOtherKeyframeSeesGoesAfterTwo) {
  const LandmarkHandle h = made_at(k[1], {k[0], k[1]});
  probation.admit_made_at(k[1]);
  probation.judge(w.id(k[1]) + 1);
  EXPECT_TRUE(w.map.landmarks().contains(h));
  probation.judge(w.id(k[1]) + 2);
  EXPECT_FALSE(w.map.landmarks().contains(h));
}

TEST_F(ProbationTest, LandmarkThatPassesIsFull) {
  const LandmarkHandle h = made_at(k[1], {k[0], k[1], k[2]});
  probation.admit_made_at(k[1]);
  probation.judge(w.id(k[1]) + Probation::kLength_keyframes - 1);
  EXPECT_EQ(w.map.landmarks()[h].state, LandmarkState::kWeak);
  probation.judge(w.id(k[1]) + Probation::kLength_keyframes);
  EXPECT_EQ(w.map.landmarks()[h].state, LandmarkState::kFull);
  EXPECT_TRUE(probation.landmarks().empty());
}

TEST(KeyframeMaker, CopiesTheFrameAndItsBearings) {
  test::MappedWorld w;
  EXPECT_TRUE(w.maker.newest().is_null());
  const auto frame = w.world.frame(3);
  const KeyframeHandle h = w.maker.make(*frame, test::PointWorld::pose(3), 5);
  const Keyframe& k = w.map.keyframes()[h];
  EXPECT_EQ(w.maker.newest(), h);
  EXPECT_EQ(w.maker.newest_id(), k.id);
  EXPECT_EQ(w.counts.keyframes_made, 1U);
  EXPECT_EQ(k.map_id, 5);
  EXPECT_EQ(k.frame_number, 3U);
  EXPECT_EQ(k.utime, frame->utime);
  EXPECT_EQ(k.T_world_body.t, test::PointWorld::pose(3).t);
  ASSERT_EQ(k.views[0].bearings.size(), frame->views[0].set.features.size());
  for (std::size_t i = 0; i < k.views[0].bearings.size(); ++i) {
    Eigen::Vector2d pixel;
    ASSERT_TRUE(w.world.rig().cameras[0].camera.project(k.views[0].bearings[i].cast<double>(), &pixel));
    EXPECT_NEAR(pixel.x(), frame->views[0].set.features[i].u_px, 1e-2);
    EXPECT_NEAR(pixel.y(), frame->views[0].set.features[i].v_px, 1e-2);
  }
}

TEST(KeyframeMaker, FullMapGivesNoneAndKeepsTheNewest) {
  EstimatorConfig config = test::small_config();
  config.capacity.keyframes = 2;
  test::MappedWorld w(config);
  w.add_keyframe(0);
  const KeyframeHandle newest = w.add_keyframe(1);
  EXPECT_TRUE(w.maker.make(*w.world.frame(2), test::PointWorld::pose(2), 1).is_null());
  EXPECT_EQ(w.maker.newest(), newest);
  EXPECT_EQ(w.counts.keyframes_made, 2U);
}

}  // namespace
}  // namespace farpoint::slam
