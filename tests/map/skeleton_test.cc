// SPDX-License-Identifier: Apache-2.0
#include "slam/map/skeleton.h"

#include <gtest/gtest.h>

#include <deque>
#include <map>
#include <vector>

#include "tests/map/map_harness.h"

namespace farpoint::slam {
namespace {

// Keyframes without a map: a pool and the skeleton.
class SkeletonTest : public testing::Test {
 protected:
  KeyframeHandle add(Skeleton* skeleton) {
    const KeyframeHandle h = keyframes.allocate();
    keyframes[h].id = next_id++;
    keyframes[h].T_world_body = random_pose(&random);
    skeleton->add(keyframes[h].id, h);
    return h;
  }
  void remove(Skeleton* skeleton, KeyframeHandle h, KeyframeHandle parent) {
    const Keyframe& k = keyframes[h];
    const Keyframe& p = keyframes[parent];
    skeleton->remove(k.id, p.id, p.S_world_body().inverse() * k.S_world_body());
    keyframes.release(h);
  }

  Random random{17};
  std::uint64_t next_id = 1;
  Pool<Keyframe> keyframes{20};
  Skeleton all{0};
};

TEST_F(SkeletonTest, TheLivingStandWhereTheyStand) {
  const KeyframeHandle h = add(&all);
  SE3 T;
  ASSERT_TRUE(all.pose_of(1, keyframes, &T));
  expect_same_pose(T, keyframes[h].T_world_body);
  keyframes[h].T_world_body = random_pose(&random);
  ASSERT_TRUE(all.pose_of(1, keyframes, &T));
  expect_same_pose(T, keyframes[h].T_world_body);
}

TEST_F(SkeletonTest, TheRemovedMoveWithTheirParents) {
  const KeyframeHandle a = add(&all), b = add(&all), c = add(&all);
  const SE3 T_b_a = keyframes[b].T_world_body.inverse() * keyframes[a].T_world_body;
  const SE3 T_c_b = keyframes[c].T_world_body.inverse() * keyframes[b].T_world_body;
  remove(&all, a, b);
  SE3 T;
  keyframes[b].T_world_body = keyframes[c].T_world_body * T_c_b;
  ASSERT_TRUE(all.pose_of(1, keyframes, &T));
  expect_same_pose(T, keyframes[b].T_world_body * T_b_a);
  remove(&all, b, c);
  keyframes[c].T_world_body = random_pose(&random);
  ASSERT_TRUE(all.pose_of(1, keyframes, &T));
  expect_same_pose(T, keyframes[c].T_world_body * T_c_b * T_b_a);
}

// A pose relative to a removed keyframe keeps that keyframe's unit, whatever units it and its parents had.
TEST_F(SkeletonTest, TheRemovedFollowTheUnitsOfTheirParents) {
  const KeyframeHandle a = add(&all), b = add(&all), c = add(&all);
  keyframes[a].scale = 3.0, keyframes[b].scale = 1.5;
  const Sim3 S_world_a = keyframes[a].S_world_body();
  remove(&all, a, b);
  remove(&all, b, c);
  const Sim3 S{2.0, so3_exp({0.3, 0.1, -0.4}), {1, 2, 3}};
  keyframes[c].T_world_body = S * keyframes[c].T_world_body;
  keyframes[c].scale *= S.scale;
  Sim3 moved;
  ASSERT_TRUE(all.similarity_of(1, keyframes, &moved));
  EXPECT_NEAR(moved.scale, 6.0, 1e-12);
  const SE3 T_a_frame{so3_exp({0, 0, 0.2}), {0.3, 0.1, 0}};
  expect_same_pose(moved * T_a_frame, S * (S_world_a * T_a_frame));
  SE3 T;
  ASSERT_TRUE(all.pose_of(1, keyframes, &T));
  expect_same_pose(T, S * SE3{S_world_a.q, S_world_a.t});
}

TEST_F(SkeletonTest, WithoutAParentThePoseIsLostAndWithItWhatHangsOnIt) {
  const KeyframeHandle a = add(&all), b = add(&all);
  remove(&all, a, b);
  all.remove_without_parent(2);
  keyframes.release(b);
  SE3 T;
  EXPECT_FALSE(all.pose_of(2, keyframes, &T));
  EXPECT_FALSE(all.pose_of(1, keyframes, &T));
}

TEST_F(SkeletonTest, IdsNeverGivenHaveNoPose) {
  SE3 T;
  EXPECT_FALSE(all.pose_of(1, keyframes, &T));
  (void)add(&all);
  EXPECT_FALSE(all.pose_of(0, keyframes, &T));
  EXPECT_FALSE(all.pose_of(2, keyframes, &T));
}

TEST_F(SkeletonTest, BoundedKeepsTheNewest) {
  Skeleton bounded(5);
  const KeyframeHandle living = add(&bounded);
  for (int i = 0; i < 100; ++i) {
    const KeyframeHandle h = add(&bounded);
    remove(&bounded, h, living);
  }
  EXPECT_EQ(bounded.size(), 5U);
  SE3 T;
  for (std::uint64_t id = 2; id <= 96; ++id) EXPECT_FALSE(bounded.pose_of(id, keyframes, &T)) << id;
  for (std::uint64_t id = 97; id <= 101; ++id) EXPECT_TRUE(bounded.pose_of(id, keyframes, &T)) << id;
  // The living one's node was dropped; the pool still has it.
  ASSERT_TRUE(bounded.pose_of(1, keyframes, &T));
  expect_same_pose(T, keyframes[living].T_world_body);
  // Its removal can no longer be noted, and those attached to it are lost with it.
  bounded.remove(1, 101, Sim3{});
  keyframes.release(living);
  EXPECT_FALSE(bounded.pose_of(1, keyframes, &T));
  EXPECT_FALSE(bounded.pose_of(101, keyframes, &T));
}

// --- in the map

TEST_F(MapTest, PoseOfChainsThroughRemovedKeyframes) {
  const auto k = keyframes(5);
  // 1 hangs on 2 by sharing most with it, though 3 is as near.
  landmark({k[0], k[1]}, 0);
  landmark({k[0], k[1], k[4]}, 1);
  for (const KeyframeHandle h : k) map.update_covisibility(h);
  const SE3 T_2_1 = map.keyframes()[k[1]].T_world_body.inverse() * map.keyframes()[k[0]].T_world_body;
  map.remove_keyframe(k[0]);
  SE3 T;
  // The parent moves (optimisation), the removed one with it.
  map.keyframes()[k[1]].T_world_body = random_pose(&random);
  ASSERT_TRUE(map.pose_of(1, &T));
  expect_same_pose(T, map.keyframes()[k[1]].T_world_body * T_2_1);
  const SE3 T_5_2 = map.keyframes()[k[4]].T_world_body.inverse() * map.keyframes()[k[1]].T_world_body;
  map.remove_keyframe(k[1]);
  map.keyframes()[k[4]].T_world_body = random_pose(&random);
  ASSERT_TRUE(map.pose_of(1, &T));
  expect_same_pose(T, map.keyframes()[k[4]].T_world_body * T_5_2 * T_2_1);
  ASSERT_TRUE(map.pose_of(2, &T));
  expect_same_pose(T, map.keyframes()[k[4]].T_world_body * T_5_2);
  // Recycling the slots changes nothing.
  keyframe();
  keyframe();
  ASSERT_TRUE(map.pose_of(1, &T));
  expect_same_pose(T, map.keyframes()[k[4]].T_world_body * T_5_2 * T_2_1);
  EXPECT_FALSE(map.pose_of(0, &T));
  EXPECT_FALSE(map.pose_of(99, &T));
}

TEST(MapSkeleton, WholeMapMovesWithItsForgottenKeyframes) {
  Map map(small_capacity(), two_camera_rig());
  Shaker shaker(&map, 31);
  std::map<std::uint64_t, SE3> poses;  // of every keyframe ever
  for (int i = 0; i < 4000; ++i) {
    shaker.step();
    map.keyframes().for_each([&](KeyframeHandle, const Keyframe& k) { poses[k.id] = k.T_world_body; });
  }
  ASSERT_GT(poses.size(), 100U);
  const SE3 shift{so3_exp({0.3, -0.2, 1.0}), {10, -20, 30}};
  for (const bool moved : {false, true}) {
    if (moved)
      map.keyframes().for_each([&](KeyframeHandle, Keyframe& k) { k.T_world_body = shift * k.T_world_body; });
    for (const auto& [id, pose] : poses) {
      SE3 T;
      ASSERT_TRUE(map.pose_of(id, &T)) << id;
      expect_same_pose(T, moved ? shift * pose : pose);
    }
  }
}

TEST_F(MapTest, TheLastKeyframeLeavesNoWayHome) {
  const KeyframeHandle a = keyframe(), b = keyframe();
  map.remove_keyframe(a);
  SE3 T;
  EXPECT_TRUE(map.pose_of(1, &T));
  map.remove_keyframe(b);
  EXPECT_FALSE(map.pose_of(1, &T));
  EXPECT_FALSE(map.pose_of(2, &T));
  map.remove_keyframe(b);  // gone already
  EXPECT_EQ(map.keyframes().size(), 0U);
}

// --- in a map without capacity.whole_trajectory

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
    const KeyframeHandle added = map.add_keyframe(make_keyframe(map.rig(), 0, pose, 10, &random));
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
