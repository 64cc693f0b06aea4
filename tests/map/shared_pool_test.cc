// SPDX-License-Identifier: Apache-2.0
#include "slam/map/shared_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "slam/spsc_ring.h"

namespace farpoint::slam {
namespace {

TEST(SharedPool, LendsEachObjectOnceAndAgainWhenItIsGivenBack) {
  int made = 0;
  SharedPool<int> pool(2, [&] { return std::make_shared<int>(made++); });
  std::shared_ptr<int> a = pool.take(), b = pool.take();
  ASSERT_TRUE(a && b);
  EXPECT_NE(a, b);
  EXPECT_FALSE(pool.take());
  EXPECT_EQ(pool.lent(), 2U);
  const int* first = a.get();
  a.reset();
  EXPECT_EQ(pool.lent(), 1U);
  EXPECT_EQ(pool.take().get(), first);
  EXPECT_EQ(made, 2);
}

TEST(SharedPool, VisitsIdleObjectsOnly) {
  SharedPool<int> pool(3, [] { return std::make_shared<int>(0); });
  const std::shared_ptr<int> lent = pool.take();
  pool.for_each_idle([](int& value) { value = 7; });
  EXPECT_EQ(*lent, 0);
  const std::shared_ptr<int> next = pool.take();
  EXPECT_EQ(*next, 7);
}

// What a reader on another thread did with an object comes before what its next owner does: for TSan.
TEST(SharedPool, HandsObjectsFromThreadToThread) {
  constexpr int kRounds = 20000;
  SharedPool<int> pool(3, [] { return std::make_shared<int>(0); });
  SpscRing<std::shared_ptr<int>> ring(4);
  std::atomic<bool> wrong{false};
  std::thread reader([&] {
    for (int i = 1; i <= kRounds;) {
      std::shared_ptr<int>* slot = ring.front();
      if (slot == nullptr) {
        std::this_thread::yield();
        continue;
      }
      if (**slot != i) wrong = true;
      slot->reset();
      ring.pop();
      ++i;
    }
  });
  for (int i = 1; i <= kRounds;) {
    std::shared_ptr<int> object = pool.take();
    std::shared_ptr<int>* slot = ring.begin_push();
    if (!object || slot == nullptr) {
      std::this_thread::yield();
      continue;
    }
    *object = i++;
    *slot = std::move(object);
    ring.end_push();
  }
  reader.join();
  EXPECT_FALSE(wrong);
}

TEST(SpscRing, IsFullAndEmptyWhereItShouldBe) {
  SpscRing<int> ring(2);
  EXPECT_EQ(ring.front(), nullptr);
  EXPECT_TRUE(ring.push(1));
  EXPECT_TRUE(ring.push(2));
  EXPECT_FALSE(ring.push(3));
  EXPECT_EQ(ring.size(), 2U);
  EXPECT_EQ(*ring.front(), 1);
  ring.pop();
  EXPECT_TRUE(ring.push(3));
  EXPECT_EQ(*ring.front(), 2);
  ring.pop();
  EXPECT_EQ(*ring.front(), 3);
  ring.pop();
  EXPECT_EQ(ring.front(), nullptr);
  EXPECT_EQ(ring.begin_push(), ring.begin_push());  // a slot that was not pushed is the next one still
}

}  // namespace
}  // namespace farpoint::slam
