// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/capture_loop.h"

#include <gtest/gtest.h>

#include <functional>
#include <stdexcept>
#include <vector>

namespace farpoint::daemon {
namespace {

constexpr double kLimit_s = 0.5;

// Plays a list of turns, then ends.
class ScriptedSource final : public CaptureSource {
 public:
  CaptureStatus next(const std::atomic<bool>& /*stop*/, CapturedImage* image) override {
    if (before_turn) before_turn(turns_);
    const std::size_t turn = turns_++;
    if (turn == turns.size()) return CaptureStatus::kEnd;
    image->in.images = static_cast<std::int64_t>(100 + turn);
    if (turns[turn] == CaptureStatus::kImage) image->meta.sequence = static_cast<std::int64_t>(turn);
    return turns[turn];
  }
  std::vector<CaptureStatus> turns;
  std::function<void(std::size_t)> before_turn;

 private:
  std::size_t turns_ = 0;
};

class CaptureLoopTest : public ::testing::Test {
 protected:
  using Status = CaptureStatus;
  ScriptedSource source_;
  ImageQueue images_{8, 4, 4};
  CameraPresence presence_;
  Notifier arrived_;
  CaptureLoop loop_{&source_, &images_, &presence_, &arrived_, kLimit_s};
};

TEST_F(CaptureLoopTest, QueuesEachImageInOrderAndClosesTheQueue) {
  source_.turns = {Status::kImage, Status::kNothing, Status::kImage};
  int captured = 0;
  const std::uint32_t seen = arrived_.seen();
  loop_.run([&] { ++captured; });
  EXPECT_EQ(captured, 2);
  EXPECT_TRUE(images_.is_closed());
  for (const int sequence : {0, 2}) {
    CapturedImage* image = images_.pop();
    ASSERT_NE(image, nullptr);
    EXPECT_EQ(image->meta.sequence, sequence);
    images_.give_back(image);
  }
  EXPECT_EQ(images_.pop(), nullptr);
  EXPECT_EQ(arrived_.seen() - seen, 3U) << "once an image, and at the end";
}

TEST_F(CaptureLoopTest, ACameraThatGoesIsNotedOnceWithItsCountsAndAnImageEndsIt) {
  source_.turns = {Status::kImage, Status::kAway, Status::kAway, Status::kImage};
  std::vector<bool> away;
  std::vector<std::uint32_t> notified;
  source_.before_turn = [&](std::size_t) {
    away.push_back(presence_.is_away());
    notified.push_back(arrived_.seen());
  };
  loop_.run({});
  EXPECT_EQ(away, (std::vector<bool>{false, false, true, true, false}));
  EXPECT_EQ(notified[2] - notified[1], 1U) << "the output is woken when it goes";
  EXPECT_EQ(notified[3] - notified[2], 0U);
  InputCounts counts;
  presence_.take_counts(&counts);
  EXPECT_EQ(counts.images, 102) << "those of the last turn without a camera";
}

TEST_F(CaptureLoopTest, WhatReadingThrowsIsKeptAndTheQueueIsClosed) {
  source_.turns = {Status::kImage, Status::kImage};
  source_.before_turn = [](std::size_t turn) {
    if (turn == 1) throw std::runtime_error("the source broke");
  };
  loop_.run({});
  EXPECT_TRUE(images_.is_closed());
  ASSERT_TRUE(loop_.error());
  EXPECT_THROW(std::rethrow_exception(loop_.error()), std::runtime_error);
}

TEST_F(CaptureLoopTest, StopEndsItAfterTheTurn) {
  source_.turns.assign(100, Status::kNothing);
  std::size_t turns = 0;
  source_.before_turn = [&](std::size_t turn) {
    turns = turn + 1;
    if (turn == 4) loop_.stop();
  };
  loop_.run({});
  EXPECT_EQ(turns, 5U);
  EXPECT_TRUE(images_.is_closed());
}

TEST_F(CaptureLoopTest, ATurnWithoutAnImageIsProgressAndAHeldOneIsNot) {
  source_.turns.assign(3, Status::kNothing);
  std::vector<bool> alive;
  double now_s = 100.0;
  source_.before_turn = [&](std::size_t) {
    alive.push_back(loop_.is_alive(now_s));
    now_s += 1.0;
    if (alive.size() == 3) alive.push_back(loop_.is_alive(now_s));  // within the same turn
  };
  loop_.run({});
  EXPECT_EQ(alive, (std::vector<bool>{true, true, true, false, true}));
  EXPECT_TRUE(loop_.is_alive(now_s + 100.0)) << "ended";
}

}  // namespace
}  // namespace farpoint::daemon
