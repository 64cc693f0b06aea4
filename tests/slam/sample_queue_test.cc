// SPDX-License-Identifier: Apache-2.0
#include "slam/sample_queue.h"

#include <gtest/gtest.h>

#include "slam/measurement.h"

namespace farpoint::slam {
namespace {

constexpr std::uint64_t kAll = ~std::uint64_t{0};

class SampleQueueTest : public ::testing::Test {
 protected:
  bool add(std::int64_t utime) {
    ImuSample sample;
    sample.utime = utime;
    return queue_.add(sample);
  }
  [[nodiscard]] std::vector<std::int64_t> kept() const {
    std::vector<std::int64_t> out;
    for (std::size_t i = 0; i < queue_.history().size(); ++i) out.push_back(queue_.history()[i].utime);
    return out;
  }
  using Times = std::vector<std::int64_t>;

  SampleQueue<ImuSample> queue_{4, 3};
};

TEST_F(SampleQueueTest, AFrameTakesWhatIsNotYoungerThanItself) {
  for (const std::int64_t utime : {10, 20, 30}) ASSERT_TRUE(add(utime));
  queue_.take_until(20, kAll);
  EXPECT_EQ(kept(), (Times{10, 20}));
  EXPECT_EQ(queue_.counts().used, 2U);
  queue_.take_until(40, kAll);
  EXPECT_EQ(kept(), (Times{10, 20, 30}));
}

TEST_F(SampleQueueTest, ASampleOfTheTimeOfAnEarlierFrameIsLate) {
  queue_.take_until(100, kAll);
  ASSERT_TRUE(add(100));
  ASSERT_TRUE(add(101));
  queue_.take_until(200, kAll);
  EXPECT_EQ(kept(), Times{101});
  EXPECT_EQ(queue_.counts().late, 1U);
  EXPECT_EQ(queue_.counts().taken(), 2U);
}

TEST_F(SampleQueueTest, ASampleNotAfterTheNewestUsedIsLate) {
  for (const std::int64_t utime : {10, 30, 20, 30}) ASSERT_TRUE(add(utime));
  queue_.take_until(100, kAll);
  EXPECT_EQ(kept(), (Times{10, 30}));
  EXPECT_EQ(queue_.counts().late, 2U);
}

TEST_F(SampleQueueTest, ARepeatedRunTakesNoMoreThanItTookThen) {
  for (const std::int64_t utime : {10, 20, 30}) ASSERT_TRUE(add(utime));
  queue_.take_until(100, 2);
  EXPECT_EQ(queue_.counts().taken(), 2U);
  EXPECT_EQ(kept(), (Times{10, 20}));
}

TEST_F(SampleQueueTest, DropsAndCountsWhatFindsNoRoom) {
  for (const std::int64_t utime : {10, 20, 30, 40}) ASSERT_TRUE(add(utime));
  EXPECT_FALSE(add(50));
  EXPECT_EQ(queue_.counts().dropped, 1U);
  queue_.take_until(100, kAll);
  EXPECT_EQ(queue_.counts().taken(), 4U);
  EXPECT_TRUE(add(110));
}

TEST_F(SampleQueueTest, KeepsTheNewestInOrder) {
  for (std::int64_t utime = 10; utime <= 70; utime += 10) {
    ASSERT_TRUE(add(utime));
    queue_.take_until(utime, kAll);
  }
  EXPECT_EQ(kept(), (Times{50, 60, 70}));
  EXPECT_EQ(queue_.counts().used, 7U);
}

}  // namespace
}  // namespace farpoint::slam
