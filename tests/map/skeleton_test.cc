// Without capacity.whole_trajectory the map remembers where its living keyframes stand and where those
// removed of late stood, and no more: a drive of days needs no more memory than one of minutes.
#include <gtest/gtest.h>

#include <deque>
#include <map>

#include "slam/map/map.h"
#include "tests/map/map_fixture.h"

namespace farpoint::slam {
namespace {

constexpr int kFeatures = 10;

CapacityConfig bounded_capacity() {
  CapacityConfig c;
  c.keyframes = 8;
  c.landmarks = 50;
  c.whole_trajectory = false;
  return c;
}

class BoundedSkeleton : public testing::Test {
 protected:
  // A new keyframe; the oldest but one goes when the map is full, so that keyframe 1 lives on.
  void drive_on() {
    if (map.keyframes().full()) {
      const KeyframeHandle leaving = alive.at(1);
      alive.erase(alive.begin() + 1);
      map.remove_keyframe(leaving);
    }
    const SE3 pose = random_pose(&random);
    const KeyframeHandle added = map.add_keyframe(make_keyframe(map.rig(), 0, pose, kFeatures, &random));
    poses[map.keyframes()[added].id] = pose;
    alive.push_back(added);
  }

  Random random{7};
  Map map{bounded_capacity(), two_camera_rig()};
  std::deque<KeyframeHandle> alive;
  std::map<std::uint64_t, SE3> poses;  // of every keyframe ever
};

TEST_F(BoundedSkeleton, KnowsTheLivingHoweverOldTheyAre) {
  for (int i = 0; i < 500; ++i) {
    drive_on();
    for (const KeyframeHandle h : alive) {
      const Keyframe& k = map.keyframes()[h];
      SE3 T;
      ASSERT_TRUE(map.pose_of(k.id, &T)) << k.id;
      EXPECT_LT((T.t - k.T_world_body.t).norm(), 1e-9);
    }
  }
  EXPECT_EQ(map.keyframes()[alive.front()].id, 1U);
}

TEST_F(BoundedSkeleton, KnowsWhereThoseRemovedOfLateStood) {
  for (int i = 0; i < 500; ++i) drive_on();
  const std::uint64_t newest = map.keyframes()[alive.back()].id;
  // Twice as many as can live.
  for (std::uint64_t id = newest - 15; id <= newest; ++id) {
    SE3 T;
    ASSERT_TRUE(map.pose_of(id, &T)) << id;
    EXPECT_LT((T.t - poses[id].t).norm(), 1e-9) << id;
  }
}

TEST_F(BoundedSkeleton, ForgetsTheRest) {
  for (int i = 0; i < 500; ++i) drive_on();
  SE3 T;
  for (std::uint64_t id = 2; id < 480; ++id) EXPECT_FALSE(map.pose_of(id, &T)) << id;
}

}  // namespace
}  // namespace farpoint::slam
