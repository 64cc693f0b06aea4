// SPDX-License-Identifier: Apache-2.0
#include "drivers/libcamera/finished_requests.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <thread>

#include "drivers/camera/camera_wait.h"

namespace farpoint::drivers {
namespace {

TEST(FinishedRequests, NoneIsLostDoubledOrOutOfOrderBetweenTwoThreads) {
  constexpr std::uint32_t kRounds = 2000, kRequests = FinishedRequests::kMaxRequests;
  FinishedRequests finished;
  std::array<std::atomic<bool>, kRequests> is_queued;
  std::array<std::uint32_t, kRequests> content{};
  for (auto& queued : is_queued) queued = true;
  std::thread signals([&] {
    for (std::uint32_t i = 0; i < kRounds; ++i) {
      const std::uint32_t request = i % kRequests;
      while (!is_queued.at(request).exchange(false)) std::this_thread::yield();
      content.at(request) = i;
      EXPECT_TRUE(finished.push(request));
    }
    finished.set_removed();
  });
  CameraWait wait;
  std::uint32_t taken = 0, request = 0;
  while (taken < kRounds) {
    wait.wait(finished.fd(), 1000);
    if (!finished.take(&request)) break;
    if (content.at(request) != taken) break;
    is_queued.at(request) = true;
    ++taken;
  }
  EXPECT_EQ(taken, kRounds);
  for (auto& queued : is_queued) queued = true;
  signals.join();
  EXPECT_TRUE(finished.was_removed());
  finished.clear();
  EXPECT_FALSE(finished.was_removed());
  EXPECT_FALSE(finished.take(&request));
}

TEST(FinishedRequests, WhatCannotBeIsNotStored) {
  FinishedRequests finished;
  EXPECT_FALSE(finished.push(FinishedRequests::kMaxRequests));
  for (std::uint32_t i = 0; i < FinishedRequests::kMaxRequests; ++i) EXPECT_TRUE(finished.push(i));
  EXPECT_FALSE(finished.push(0));
}

}  // namespace
}  // namespace farpoint::drivers
