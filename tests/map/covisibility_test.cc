// SPDX-License-Identifier: Apache-2.0
#include "slam/map/covisibility.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <utility>
#include <vector>

#include "tests/map/map_harness.h"

namespace farpoint::slam {
namespace {

constexpr double kWide_rad = 0.02;

// Pools without a map.
class CovisibilityTest : public testing::Test {
 protected:
  explicit CovisibilityTest(const CovisibilityOptions& options = {.wide_parallax_rad = kWide_rad})
      : covisibility(options, &keyframes, landmarks) {}

  KeyframeHandle keyframe() {
    const KeyframeHandle h = keyframes.allocate();
    keyframes[h].id = next_id++;
    return h;
  }
  // Landmarks that all of `observers` see.
  void share(const std::vector<KeyframeHandle>& observers, int count, double parallax_rad,
             LandmarkState state = LandmarkState::kFull) {
    for (int i = 0; i < count; ++i) {
      const LandmarkHandle h = landmarks.allocate();
      landmarks[h].state = state;
      landmarks[h].max_parallax_rad = parallax_rad;
      for (const KeyframeHandle k : observers) {
        Observation o;
        o.keyframe = k;
        o.feature = static_cast<std::int32_t>(keyframes[k].views[0].landmarks.size());
        landmarks[h].observations.push_back(o);
        keyframes[k].views[0].landmarks.push_back(h);
      }
    }
  }
  void share(KeyframeHandle a, KeyframeHandle b, int count, double parallax_rad) {
    share({a, b}, count, parallax_rad);
  }

  std::uint64_t next_id = 1;
  Pool<Keyframe> keyframes{12};
  Pool<Landmark> landmarks{60};
  Covisibility covisibility;
  const KeyframeHandle centre = keyframe(), far = keyframe(), near = keyframe(), nearer = keyframe();
};

TEST_F(CovisibilityTest, OneWideLandmarkCountsMoreThanManyNarrowOnes) {
  share(centre, far, 4, 0.5 * kWide_rad);
  share(centre, near, 1, 2 * kWide_rad);
  share(centre, near, 1, 0.5 * kWide_rad);
  share(centre, nearer, 2, kWide_rad);
  covisibility.update(centre);
  const auto& list = keyframes[centre].covisible;
  ASSERT_EQ(list.size(), 3U);
  EXPECT_EQ(list[0].keyframe, nearer);
  EXPECT_EQ(list[0].wide, 2);
  EXPECT_EQ(list[1].keyframe, near);
  EXPECT_EQ(list[1].wide, 1);
  EXPECT_EQ(list[1].shared, 2);
  EXPECT_EQ(list[2].keyframe, far);
  EXPECT_EQ(list[2].wide, 0);
  EXPECT_EQ(list[2].shared, 4);
  // Seen from the other side too.
  ASSERT_EQ(keyframes[near].covisible.size(), 1U);
  EXPECT_EQ(keyframes[near].covisible[0].wide, 1);
}

TEST_F(CovisibilityTest, OfEqualsTheNewestComesFirst) {
  share(centre, far, 3, 1.0);
  share(centre, near, 3, 1.0);
  share(centre, nearer, 3, 1.0);
  covisibility.update(centre);
  const auto& list = keyframes[centre].covisible;
  ASSERT_EQ(list.size(), 3U);
  EXPECT_EQ(list[0].keyframe, nearer);
  EXPECT_EQ(list[1].keyframe, near);
  EXPECT_EQ(list[2].keyframe, far);
}

TEST_F(CovisibilityTest, VirtualPointsDoNotCount) {
  share({centre, near}, 5, 1.0, LandmarkState::kBearing);
  share({centre, near}, 1, 1.0, LandmarkState::kWeak);
  covisibility.update(centre);
  ASSERT_EQ(keyframes[centre].covisible.size(), 1U);
  EXPECT_EQ(keyframes[centre].covisible[0].shared, 1);
}

TEST_F(CovisibilityTest, AnUpdateRenewsBothSides) {
  share(centre, near, 2, 1.0);
  covisibility.update(near);
  share(centre, near, 3, 1.0);
  EXPECT_EQ(keyframes[centre].covisible.at(0).shared, 2);
  covisibility.update(centre);
  ASSERT_EQ(keyframes[near].covisible.size(), 1U);
  EXPECT_EQ(keyframes[near].covisible[0].shared, 5);
  EXPECT_EQ(keyframes[centre].covisible.at(0).shared, 5);
}

TEST_F(CovisibilityTest, WhatIsSharedNoMoreLeavesBothLists) {
  share(centre, near, 1, 1.0);
  covisibility.update(centre);
  landmarks.release(keyframes[near].views[0].landmarks[0]);
  covisibility.update(near);
  EXPECT_TRUE(keyframes[centre].covisible.empty());
  EXPECT_TRUE(keyframes[near].covisible.empty());
}

// Two entries a list.
class ShortLists : public CovisibilityTest {
 protected:
  ShortLists() : CovisibilityTest({.longest_list = 2}) {}
};

TEST_F(ShortLists, KeepTheStrongest) {
  std::vector<KeyframeHandle> k;
  k.reserve(5);
  for (int i = 0; i < 5; ++i) k.push_back(keyframe());
  const auto names = [&](int i) {
    std::vector<KeyframeHandle> list;
    for (const Covisible& c : keyframes[k[static_cast<std::size_t>(i)]].covisible) list.push_back(c.keyframe);
    return list;
  };
  share(k[0], k[1], 1, 1.0);
  share(k[0], k[2], 2, 1.0);
  share(k[0], k[3], 3, 1.0);
  covisibility.update(k[0]);
  EXPECT_EQ(names(0), (std::vector{k[3], k[2]}));
  EXPECT_EQ(names(1), (std::vector{k[0]})) << "it has room for one that has none for it";
  // A stronger one pushes the weakest out of a full list.
  share(k[4], k[0], 4, 1.0);
  covisibility.update(k[4]);
  EXPECT_EQ(names(0), (std::vector{k[4], k[3]}));
  EXPECT_EQ(names(4), (std::vector{k[0]}));
  // A keyframe that leaves is in no list afterwards, though its own list did not hold them all.
  covisibility.leave(k[0]);
  for (int i = 1; i < 5; ++i) EXPECT_TRUE(names(i).empty());
}

// --- in the map

TEST(MapCovisibility, CountsWhatBruteForceCounts) {
  const CapacityConfig capacity = small_capacity();
  Map map(capacity, two_camera_rig());
  Shaker shaker(&map, 21);
  int pairs = 0;
  for (int round = 0; round < 40; ++round) {
    for (int i = 0; i < 60; ++i) shaker.step();
    const auto all = alive(map.keyframes());
    for (const KeyframeHandle k : all) map.update_covisibility(k);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> expected;
    map.landmarks().for_each([&](LandmarkHandle, const Landmark& l) {
      if (l.state == LandmarkState::kBearing) return;
      std::set<std::uint32_t> observers;  // each once, by however many cameras
      for (const Observation& o : l.observations) observers.insert(o.keyframe.index);
      for (const std::uint32_t a : observers)
        for (const std::uint32_t b : observers)
          if (a != b) ++expected[{a, b}];
    });
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> counted;
    for (const KeyframeHandle k : all)
      for (const Covisible& c : map.keyframes()[k].covisible) counted[{k.index, c.keyframe.index}] = c.shared;
    ASSERT_EQ(counted, expected) << "round " << round;
    check(map, capacity);
    ASSERT_FALSE(testing::Test::HasFailure());
    pairs += static_cast<int>(counted.size());
  }
  EXPECT_GT(pairs, 500);
}

TEST_F(MapTest, CovisibilityOfOneUpdateReachesTheOthers) {
  const auto k = keyframes(3);
  landmark({k[0], k[1]}, 0);
  landmark({k[0], k[1]}, 1);
  landmark({k[0], k[2]}, 2);
  map.update_covisibility(k[0]);
  const auto& list = map.keyframes()[k[0]].covisible;
  ASSERT_EQ(list.size(), 2U);
  EXPECT_EQ(list[0].keyframe, k[1]);
  EXPECT_EQ(list[0].shared, 2);
  EXPECT_EQ(list[1].keyframe, k[2]);
  ASSERT_EQ(map.keyframes()[k[1]].covisible.size(), 1U);
  EXPECT_EQ(map.keyframes()[k[1]].covisible[0].shared, 2);
  check(map, capacity);
  map.remove_keyframe(k[1]);
  EXPECT_EQ(map.keyframes()[k[0]].covisible.size(), 1U);
  check(map, capacity);
}

}  // namespace
}  // namespace farpoint::slam
