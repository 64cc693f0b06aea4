// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/run_tally.h"

#include <gtest/gtest.h>

namespace farpoint::daemon {
namespace {

slam::FrameResult at(std::int64_t utime) {
  slam::FrameResult result;
  result.utime = utime;
  return result;
}

slam::EstimatorCounts with_maps(std::uint64_t maps) {
  slam::EstimatorCounts counts;
  counts.maps = maps;
  return counts;
}

TEST(RunTally, CountsFramesAndKeepsTheTimesOfValidOnes) {
  RunTally tally(true);
  EXPECT_EQ(tally.end().initialised_utime, -1);
  tally.note(at(100), false, with_maps(0));
  tally.note(at(200), false, with_maps(1));
  tally.note(at(300), true, with_maps(1));
  tally.note(at(400), true, with_maps(2));
  const RunEnd& end = tally.end();
  EXPECT_EQ(end.frames, 4);
  EXPECT_EQ(end.frames_valid, 2);
  EXPECT_EQ(end.first_utime, 100);
  EXPECT_EQ(end.initialised_utime, 200);
  EXPECT_EQ(end.utime, 400);
  EXPECT_EQ(end.last.utime, 400);
  EXPECT_EQ(end.counts.maps, 2U);
  EXPECT_EQ(end.live_utimes, (std::vector<std::int64_t>{300, 400}));
}

TEST(RunTally, WithoutTimesItDoesNotGrow) {
  RunTally tally(false);
  for (int i = 0; i < 1000; ++i) tally.note(at(i), true, with_maps(1));
  EXPECT_EQ(tally.end().frames_valid, 1000);
  EXPECT_TRUE(tally.end().live_utimes.empty());
}

}  // namespace
}  // namespace farpoint::daemon
