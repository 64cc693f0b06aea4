// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/side_functions.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

#include "daemon/system/stage_clock.h"

namespace farpoint::daemon {
namespace {

TEST(SideFunctions, OneThatBeginsIsNotMissing) {
  SideFunctions side;
  int attempts = 0;
  side.begin(SideFunction::kRecording, "--record", [&] { ++attempts; });
  side.retry();
  EXPECT_EQ(attempts, 1);
  EXPECT_EQ(side.missing(), 0);
  EXPECT_EQ(side.failures(), 0);
}

TEST(SideFunctions, OneThatCannotBeginIsMissingAndTriedAgainUntilItCan) {
  SideFunctions side;
  bool route = false;
  int attempts = 0;
  const auto open = [&] {
    ++attempts;
    if (!route) throw std::runtime_error("no route");
  };
  side.begin(SideFunction::kLcm, "LCM", open);
  side.begin(SideFunction::kCanLog, "can.log", [] { throw std::runtime_error("no folder"); });
  EXPECT_EQ(side.missing(), (1 << 0) | (1 << 3));
  side.retry();
  EXPECT_EQ(side.failures(), 4);
  route = true;
  side.retry();
  EXPECT_EQ(side.missing(), 1 << 3);
  EXPECT_EQ(side.failures(), 5);
  side.retry();
  EXPECT_EQ(attempts, 3) << "no attempt after the one that worked";
}

TEST(SideFunctions, ItsThreadTriesAndStopsAtOnce) {
  SideFunctions side;
  std::atomic<int> attempts{0};
  side.begin(SideFunction::kLcm, "LCM", [&] {
    if (++attempts < 3) throw std::runtime_error("no route");
  });
  side.begin(SideFunction::kLogFile, "log.file", [] { throw std::runtime_error("no folder"); });
  side.start(RealtimeConfig{}, nullptr);
  while (attempts < 3) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  while ((side.missing() & 1) != 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const double began_s = steady_s();
  side.stop();
  EXPECT_LT(steady_s() - began_s, 30.0);
  EXPECT_EQ(side.missing(), 1 << 5);
}

}  // namespace
}  // namespace farpoint::daemon
