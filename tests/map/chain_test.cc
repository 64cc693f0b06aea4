// SPDX-License-Identifier: Apache-2.0
#include "slam/map/chain.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "tests/map/map_harness.h"

namespace farpoint::slam {
namespace {

std::int64_t utime_of(int i) {
  return 1'000'000 + 500'000 * i;
}

KeyframeHandle numbered(std::uint32_t index) {
  return {index, 0};
}

// Five keyframes, half a second apart.
class ChainOfFive : public testing::Test {
 protected:
  ChainOfFive() {
    chain.begin(k[0]);
    for (std::size_t i = 1; i < k.size(); ++i) {
      const int at = static_cast<int>(i);
      chain.extend(k[i - 1], k[i], {.from_utime = utime_of(at - 1), .to_utime = utime_of(at)});
    }
  }
  void expect_order(const std::vector<KeyframeHandle>& order) {
    for (std::size_t i = 0; i < order.size(); ++i) {
      EXPECT_EQ(chain.before(order[i]), i > 0 ? order[i - 1] : KeyframeHandle{}) << i;
      EXPECT_EQ(chain.after(order[i]), i + 1 < order.size() ? order[i + 1] : KeyframeHandle{}) << i;
      EXPECT_EQ(chain.link_to(order[i]) == nullptr, i == 0) << i;
    }
  }
  void expect_link(KeyframeHandle to, int from, int until, std::uint32_t removed) {
    const ChainLink* link = std::as_const(chain).link_to(to);
    ASSERT_NE(link, nullptr);
    EXPECT_EQ(link->from_utime, utime_of(from));
    EXPECT_EQ(link->to_utime, utime_of(until));
    EXPECT_EQ(link->removed_keyframes, removed);
    EXPECT_DOUBLE_EQ(link->duration_s(), 0.5 * (until - from));
  }

  Chain chain{12};
  // Slots in another order than time's, as in a pool that has been used for long.
  const std::vector<KeyframeHandle> k = {numbered(7), numbered(0), numbered(3), numbered(11), numbered(4)};
};

TEST_F(ChainOfFive, KnowsBeforeAndAfter) {
  expect_order(k);
  for (int i = 1; i < 5; ++i) expect_link(k[static_cast<std::size_t>(i)], i - 1, i, 0);
}

TEST_F(ChainOfFive, WithoutItsFirstBeginsAtTheSecond) {
  chain.remove(k[0]);
  expect_order({k[1], k[2], k[3], k[4]});
  expect_link(k[2], 1, 2, 0);
  // The link that went does not come back with the next one to go.
  chain.remove(k[1]);
  expect_order({k[2], k[3], k[4]});
  expect_link(k[3], 2, 3, 0);
}

TEST_F(ChainOfFive, JoinsTheLinksOnBothSidesOfOneInTheMiddle) {
  chain.remove(k[2]);
  expect_order({k[0], k[1], k[3], k[4]});
  expect_link(k[1], 0, 1, 0);
  expect_link(k[3], 1, 3, 1);
  chain.remove(k[1]);
  expect_order({k[0], k[3], k[4]});
  expect_link(k[3], 0, 3, 2);
  chain.remove(k[3]);
  expect_order({k[0], k[4]});
  expect_link(k[4], 0, 4, 3);
}

TEST_F(ChainOfFive, WithoutItsLastEndsBefore) {
  chain.remove(k[4]);
  expect_order({k[0], k[1], k[2], k[3]});
  chain.extend(k[3], numbered(4), {.from_utime = utime_of(3), .to_utime = utime_of(9)});
  expect_order({k[0], k[1], k[2], k[3], numbered(4)});
  expect_link(numbered(4), 3, 9, 0);
}

TEST_F(ChainOfFive, ForgetsTheRemoved) {
  chain.remove(k[2]);
  EXPECT_TRUE(chain.before(k[2]).is_null());
  EXPECT_TRUE(chain.after(k[2]).is_null());
  EXPECT_EQ(chain.link_to(k[2]), nullptr);
}

TEST_F(ChainOfFive, OtherChainsAreNotTouched) {
  chain.begin(numbered(1));
  chain.extend(numbered(1), numbered(2), {.from_utime = utime_of(20), .to_utime = utime_of(21)});
  chain.remove(k[4]);
  chain.remove(k[0]);
  expect_order({numbered(1), numbered(2)});
  expect_link(numbered(2), 20, 21, 0);
  expect_order({k[1], k[2], k[3]});
}

// Through the map: keyframes of two maps in turn.
class ChainOfMap : public testing::Test {
 protected:
  ChainOfMap() {
    for (int i = 0; i < 8; ++i) {
      Keyframe keyframe = make_keyframe(map.rig(), 0, random_pose(&random), 4, &random);
      keyframe.map_id = i % 2;
      keyframe.utime = utime_of(i);
      k.push_back(map.add_keyframe(std::move(keyframe)));
    }
  }
  void expect_link(KeyframeHandle from, KeyframeHandle to, std::uint32_t removed) {
    EXPECT_EQ(map.chain().before(to), from);
    EXPECT_EQ(map.chain().after(from), to);
    const ChainLink* link = map.link_to(to);
    ASSERT_NE(link, nullptr);
    EXPECT_EQ(link->from_utime, map.keyframes()[from].utime);
    EXPECT_EQ(link->to_utime, map.keyframes()[to].utime);
    EXPECT_EQ(link->removed_keyframes, removed);
  }

  Random random{3};
  Map map{small_capacity(), two_camera_rig()};
  std::vector<KeyframeHandle> k;
};

TEST_F(ChainOfMap, LeadsFromKeyframeToKeyframeOfOneMap) {
  for (std::size_t i = 2; i < k.size(); ++i) expect_link(k[i - 2], k[i], 0);
  EXPECT_TRUE(map.chain().before(k[0]).is_null());
  EXPECT_TRUE(map.chain().before(k[1]).is_null());
}

TEST_F(ChainOfMap, ForgottenKeyframesAreBridged) {
  map.remove_keyframe(k[4]);
  expect_link(k[2], k[6], 1);
  map.remove_keyframe(k[0]);
  EXPECT_TRUE(map.chain().before(k[2]).is_null());
  EXPECT_EQ(map.link_to(k[2]), nullptr);
  map.remove_keyframe(k[6]);
  EXPECT_TRUE(map.chain().after(k[2]).is_null());
  for (const std::size_t i : {3U, 5U, 7U}) expect_link(k[i - 2], k[i], 0);
}

TEST_F(ChainOfMap, WhatWasMeasuredIsKept) {
  map.link_to(k[3])->removed_keyframes = 40;
  map.link_to(k[5])->removed_keyframes = 2;
  map.remove_keyframe(k[3]);
  expect_link(k[1], k[5], 43);
}

TEST_F(ChainOfMap, NewKeyframesHangBehindTheNewest) {
  map.remove_keyframe(k[7]);
  Keyframe keyframe = make_keyframe(map.rig(), 0, random_pose(&random), 4, &random);
  keyframe.map_id = 1;
  keyframe.utime = utime_of(30);
  const KeyframeHandle added = map.add_keyframe(std::move(keyframe));  // in the slot of the one removed
  expect_link(k[5], added, 0);
}

TEST_F(ChainOfMap, OfADiscardedMapNothingIsLeft) {
  map.discard_map(0);
  for (const std::size_t i : {0U, 2U, 4U, 6U}) {
    EXPECT_TRUE(map.chain().before(k[i]).is_null());
    EXPECT_TRUE(map.chain().after(k[i]).is_null());
  }
  for (const std::size_t i : {3U, 5U, 7U}) expect_link(k[i - 2], k[i], 0);
}

}  // namespace
}  // namespace farpoint::slam
