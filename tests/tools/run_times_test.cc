// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluate/run_times.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tools/evaluate/table.h"

namespace farpoint::tools {
namespace {

// At 20 Hz; frame i was tracked in 1 + i / n ms of which all was elapsed too, and went out 0.5 ms after that.
std::vector<TimedFrame> live_frames(int n) {
  std::vector<TimedFrame> frames;
  for (int i = 0; i < n; ++i) {
    const double tracking_ms = 1.0 + static_cast<double>(i) / n;
    frames.push_back({50'000LL * i, tracking_ms, tracking_ms, tracking_ms + 0.5, 100.0 + i});
  }
  return frames;
}

TEST(RunTimes, LatencyIsTrackingAndWhatIsBeyondIt) {
  const auto metrics = measure_latency(live_frames(101));
  ASSERT_TRUE(metrics.has_value());
  EXPECT_NEAR(metrics->p50_ms, 1.5 + 50.0 / 101.0, 1e-9);
  EXPECT_NEAR(metrics->max_ms, 1.5 + 100.0 / 101.0, 1e-9);
  EXPECT_NEAR(metrics->beyond_tracking_p50_ms, 0.5, 1e-9);
  EXPECT_NEAR(metrics->beyond_tracking_p99_ms, 0.5, 1e-9);
  EXPECT_NEAR(metrics->frame_period_ms, 50.0, 1e-9);
  EXPECT_EQ(metrics->later_than_a_frame, 0);
  RunMetrics run;
  run.latency = metrics;
  EXPECT_NE(details_text(run).find("later_than_a_frame=0"), std::string::npos);
}

TEST(RunTimes, FramesLaterThanAPeriodAreCounted) {
  std::vector<TimedFrame> frames = live_frames(101);
  frames[7].latency_ms = 50.1;
  frames[8].latency_ms = 49.9;
  frames[9].latency_ms = 400.0;
  EXPECT_EQ(measure_latency(frames)->later_than_a_frame, 2);
}

TEST(RunTimes, LockstepHasNoLatency) {
  std::vector<TimedFrame> frames = live_frames(101);
  for (TimedFrame& frame : frames) frame.latency_ms = -1.0;
  EXPECT_FALSE(measure_latency(frames).has_value());
  EXPECT_FALSE(measure_latency({}).has_value());
}

TEST(RunTimes, TrackingThatWasNotMeasuredIsLeftOut) {
  std::vector<TimedFrame> frames = live_frames(101);
  for (TimedFrame& frame : frames) frame.tracking_wall_ms = frame.tracking_cpu_ms = -1.0;
  EXPECT_TRUE(std::isnan(measure_latency(frames)->beyond_tracking_p99_ms));
}

TEST(RunTimes, SteadinessComparesEarlyAndLate) {
  std::vector<TimedFrame> frames = live_frames(2000);
  const auto metrics = measure_steadiness(frames);
  ASSERT_TRUE(metrics.has_value());
  // Frames 100 to 199 and 1900 to 1999; the 99th percentile lies a hundredth below the last.
  EXPECT_NEAR(metrics->second_twentieth_p99_ms, 1.0 + 198.01 / 2000.0, 1e-6);
  EXPECT_NEAR(metrics->last_twentieth_p99_ms, 1.0 + 1998.01 / 2000.0, 1e-6);
  EXPECT_EQ(metrics->tenth_mb, 299.0);
  EXPECT_EQ(metrics->half_mb, 1099.0);
  EXPECT_EQ(metrics->end_mb, 2099.0);
  EXPECT_FALSE(measure_steadiness(live_frames(399)).has_value());
}

}  // namespace
}  // namespace farpoint::tools
