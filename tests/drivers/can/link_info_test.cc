// SPDX-License-Identifier: Apache-2.0
#include "drivers/can/link_info.h"

#include <gtest/gtest.h>

namespace farpoint::drivers {
namespace {

TEST(LinkInfo, TheKernelTellsTheQueueOfAnInterface) {
  const auto link = read_link("lo");
  if (!link) GTEST_SKIP() << "no netlink on this machine";
  EXPECT_FALSE(link->queue.empty());
  EXPECT_GT(link->txqueuelen, 0U);
  EXPECT_FALSE(read_link("nosuchlink0"));
}

TEST(LinkInfo, AQueueThatDoesNotFitAnEpochIsSaid) {
  EXPECT_EQ(queue_problem({10, "pfifo_fast"}, 9), "");
  EXPECT_EQ(queue_problem({0, "noqueue"}, 9), "");  // vcan
  EXPECT_NE(queue_problem({8, "pfifo_fast"}, 9).find("holds 8 frames, expected room for the 9"),
            std::string::npos);
  EXPECT_NE(queue_problem({1000, "fq_codel"}, 9).find("is fq_codel, which may drop or reorder"),
            std::string::npos);
}

}  // namespace
}  // namespace farpoint::drivers
