// SPDX-License-Identifier: Apache-2.0
#include "slam/map/pool.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <vector>

namespace farpoint::slam {
namespace {

TEST(Pool, StartsEmptyAndFillsInOrder) {
  Pool<int> pool(3);
  EXPECT_EQ(pool.size(), 0U);
  EXPECT_EQ(pool.capacity(), 3U);
  for (std::uint32_t i = 0; i < 3; ++i) EXPECT_EQ(pool.allocate().index, i);
  EXPECT_TRUE(pool.full());
}

TEST(Pool, FullGivesTheNullHandle) {
  Pool<int> pool(1);
  const Handle<int> only = pool.allocate();
  EXPECT_FALSE(only.is_null());
  const Handle<int> none = pool.allocate();
  EXPECT_TRUE(none.is_null());
  EXPECT_FALSE(pool.contains(none));
  EXPECT_EQ(pool.get(none), nullptr);
  EXPECT_EQ(pool.size(), 1U);
}

TEST(Pool, NullHandleIsNothing) {
  Pool<int> pool(2);
  const Handle<int> null;
  EXPECT_TRUE(null.is_null());
  EXPECT_FALSE(pool.contains(null));
  EXPECT_FALSE(pool.release(null));
}

TEST(Pool, AStaleHandleNeverFindsTheNextTenant) {
  Pool<int> pool(2);
  const Handle<int> first = pool.allocate();
  pool[first] = 1;
  EXPECT_TRUE(pool.release(first));
  EXPECT_FALSE(pool.contains(first));
  EXPECT_EQ(pool.get(first), nullptr);
  const Handle<int> second = pool.allocate();
  EXPECT_EQ(second.index, first.index);
  EXPECT_NE(second, first);
  pool[second] = 2;
  EXPECT_EQ(pool.get(first), nullptr);
  EXPECT_FALSE(pool.release(first));
  EXPECT_EQ(*pool.get(second), 2);
  EXPECT_EQ(pool.size(), 1U);
}

TEST(Pool, TheLastReturnedSlotGoesOutFirst) {
  Pool<int> pool(4);
  std::vector<Handle<int>> h;
  for (int i = 0; i < 3; ++i) h.push_back(pool.allocate());
  pool.release(h[0]);
  pool.release(h[2]);
  EXPECT_EQ(pool.allocate().index, h[2].index);
  EXPECT_EQ(pool.allocate().index, h[0].index);
  EXPECT_EQ(pool.allocate().index, 3U);
}

TEST(Pool, VisitsBySlotAndLetsTheVisitorRelease) {
  Pool<int> pool(5);
  for (int i = 0; i < 5; ++i) pool[pool.allocate()] = i;
  std::vector<int> seen;
  pool.for_each([&](Handle<int> h, const int& v) {
    seen.push_back(v);
    if (v % 2 == 0) pool.release(h);
  });
  EXPECT_EQ(seen, (std::vector<int>{0, 1, 2, 3, 4}));
  seen.clear();
  const Pool<int>& constant = pool;
  constant.for_each([&](Handle<int>, const int& v) { seen.push_back(v); });
  EXPECT_EQ(seen, (std::vector<int>{1, 3}));
}

TEST(Pool, NothingMovesWhileOthersComeAndGo) {
  Pool<int> pool(8);
  const Handle<int> kept = pool.allocate();
  const int* where = pool.get(kept);
  for (int i = 0; i < 100; ++i) {
    const Handle<int> h = pool.allocate();
    pool.release(h);
  }
  EXPECT_EQ(pool.get(kept), where);
}

// Thousands of random operations against a plain map; run twice, they give the same handles.
TEST(Pool, AgreesWithAModelAndRepeats) {
  const auto run = [](std::vector<Handle<int>>* given) {
    std::mt19937_64 random(3);
    Pool<int> pool(50);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> model;
    std::vector<Handle<int>> ended;
    for (int i = 0; i < 20000; ++i) {
      if (random() % 2 == 0) {
        const Handle<int> h = pool.allocate();
        ASSERT_EQ(h.is_null(), model.size() == 50);
        given->push_back(h);
        if (h.is_null()) continue;
        pool[h] = i;
        ASSERT_TRUE(model.emplace(std::pair{h.index, h.generation}, i).second);
      } else if (!model.empty()) {
        auto it = std::next(model.begin(), static_cast<std::ptrdiff_t>(random() % model.size()));
        const Handle<int> h{it->first.first, it->first.second};
        ASSERT_EQ(pool[h], it->second);
        ASSERT_TRUE(pool.release(h));
        ended.push_back(h);
        model.erase(it);
      }
      ASSERT_EQ(pool.size(), model.size());
      if (!ended.empty()) {
        ASSERT_EQ(pool.get(ended[random() % ended.size()]), nullptr);
      }
    }
  };
  std::vector<Handle<int>> first, second;
  run(&first);
  run(&second);
  EXPECT_EQ(first, second);
  EXPECT_GT(first.size(), 9000U);
}

}  // namespace
}  // namespace farpoint::slam
