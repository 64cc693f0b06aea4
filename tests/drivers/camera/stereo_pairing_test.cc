// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/stereo_pairing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <random>
#include <set>
#include <vector>

#include "tests/ipc/allocations.h"

namespace farpoint::drivers {
namespace {

using Side = StereoPairing::Side;

constexpr std::int64_t kPeriod_us = 33'333;

// Everything that is decided at `now_us`.
std::vector<StereoFrame> drain(StereoPairing* pairing, std::int64_t now_us) {
  std::vector<StereoFrame> frames;
  for (StereoFrame frame; pairing->take(now_us, &frame);) frames.push_back(frame);
  return frames;
}

TEST(StereoPairing, PartnersWithinTheToleranceArePairs) {
  for (const std::int64_t apart_us : {-5000, -1, 0, 3000, 5000}) {
    StereoPairing pairing({5000, 20'000});
    ASSERT_TRUE(pairing.put(Side::kLeft, {100'000, 1}, 110'000));
    EXPECT_TRUE(drain(&pairing, 110'000).empty());
    EXPECT_EQ(pairing.due_us(), 130'000);
    ASSERT_TRUE(pairing.put(Side::kRight, {100'000 + apart_us, 2}, 112'000));
    const auto frames = drain(&pairing, 112'000);
    ASSERT_EQ(frames.size(), 1U) << apart_us;
    ASSERT_TRUE(frames[0].is_pair());
    EXPECT_EQ(frames[0].left->sequence, 1);
    EXPECT_EQ(frames[0].right->sequence, 2);
    EXPECT_EQ(frames[0].utime(), 100'000);
    EXPECT_EQ(pairing.counts().pairs, 1);
    EXPECT_FALSE(pairing.due_us());
  }
}

TEST(StereoPairing, BeyondTheToleranceTheOlderGoesOnAloneAndTheOtherStillWaits) {
  StereoPairing pairing({5000, 20'000});
  ASSERT_TRUE(pairing.put(Side::kLeft, {100'000, 1}, 110'000));
  ASSERT_TRUE(pairing.put(Side::kRight, {105'001, 2}, 110'000));
  auto frames = drain(&pairing, 110'000);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_TRUE(frames[0].left && !frames[0].right);
  ASSERT_TRUE(pairing.put(Side::kLeft, {106'000, 3}, 115'000));
  frames = drain(&pairing, 115'000);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_TRUE(frames[0].is_pair());
  EXPECT_EQ(pairing.counts().left_alone, 1);
  EXPECT_EQ(pairing.counts().pairs, 1);
}

TEST(StereoPairing, AMissingPartnerCostsItsPatienceAndTheFrameIsMono) {
  StereoPairing pairing({5000, 20'000});
  ASSERT_TRUE(pairing.put(Side::kRight, {100'000, 1}, 110'000));
  EXPECT_TRUE(drain(&pairing, 129'999).empty());
  const auto frames = drain(&pairing, 130'000);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_TRUE(!frames[0].left && frames[0].right);
  EXPECT_EQ(frames[0].utime(), 100'000);
  EXPECT_EQ(pairing.counts().right_alone, 1);
  // It comes after all, too late: frames go on in the order of their times.
  EXPECT_FALSE(pairing.put(Side::kLeft, {99'000, 2}, 131'000));
  EXPECT_EQ(pairing.counts().late, 1);
}

TEST(StereoPairing, ACameraThatIsAwayIsNotWaitedFor) {
  StereoPairing pairing({5000, 20'000});
  pairing.set_away(Side::kRight, true);
  ASSERT_TRUE(pairing.put(Side::kLeft, {100'000, 1}, 110'000));
  EXPECT_EQ(drain(&pairing, 110'000).size(), 1U);
  pairing.set_away(Side::kRight, false);
  ASSERT_TRUE(pairing.put(Side::kLeft, {133'333, 1}, 143'333));
  EXPECT_TRUE(drain(&pairing, 143'333).empty());
}

TEST(StereoPairing, ATimeThatDoesNotGrowIsNotTaken) {
  StereoPairing pairing({5000, 20'000});
  ASSERT_TRUE(pairing.put(Side::kLeft, {100'000, 1}, 110'000));
  EXPECT_FALSE(pairing.put(Side::kLeft, {100'000, 2}, 110'000));
  EXPECT_FALSE(pairing.put(Side::kLeft, {99'000, 3}, 110'000));
  EXPECT_EQ(pairing.counts().late, 2);
}

TEST(StereoPairing, MoreImagesThanItHoldsGoOnBeforeTheirPatienceEnds) {
  StereoPairing pairing({5000, 1'000'000'000});
  std::int64_t given = 0;
  for (std::int64_t i = 1; i <= 100; ++i) {
    ASSERT_TRUE(pairing.put(Side::kLeft, {i * kPeriod_us, 0}, i * kPeriod_us));
    given += static_cast<std::int64_t>(drain(&pairing, i * kPeriod_us).size());
  }
  EXPECT_GT(given, 90);
  EXPECT_EQ(pairing.counts().left_alone, given);
}

// Two cameras with jitter and latencies of their own that lose images: nothing is lost, doubled, paired
// wrongly or out of order, and each image with a partner is paired.
TEST(StereoPairing, WhateverTheCamerasLoseAllElseFindsItsPartner) {
  struct Arrival {
    std::int64_t at_us;
    Side side;
    CameraFrame image;
  };
  for (unsigned int seed = 0; seed < 50; ++seed) {
    std::mt19937 random(seed);
    std::uniform_int_distribution<std::int64_t> jitter_us(-2000, 2000), latency_us(1000, 15'000);
    std::bernoulli_distribution lost(0.1);
    std::vector<Arrival> arrivals;
    std::set<std::int64_t> left, right;
    for (std::int64_t i = 1; i <= 300; ++i) {
      const std::int64_t at_us = i * kPeriod_us;
      for (const Side side : {Side::kLeft, Side::kRight}) {
        const CameraFrame image{at_us + jitter_us(random), i};
        const std::int64_t came_us = image.utime + latency_us(random);
        if (lost(random)) continue;
        (side == Side::kLeft ? left : right).insert(i);
        arrivals.push_back({came_us, side, image});
      }
    }
    std::sort(arrivals.begin(), arrivals.end(),
              [](const Arrival& a, const Arrival& b) { return a.at_us < b.at_us; });
    StereoPairing pairing({5000, 20'000});
    std::vector<StereoFrame> frames;
    for (const Arrival& a : arrivals) {
      // As a thread would that waits until due_us() at most.
      if (const auto due_us = pairing.due_us(); due_us && *due_us < a.at_us)
        for (const StereoFrame& frame : drain(&pairing, *due_us)) frames.push_back(frame);
      ASSERT_TRUE(pairing.put(a.side, a.image, a.at_us));
      for (const StereoFrame& frame : drain(&pairing, a.at_us)) frames.push_back(frame);
    }
    for (const StereoFrame& frame : drain(&pairing, 1LL << 60)) frames.push_back(frame);

    std::set<std::int64_t> seen_left, seen_right;
    std::int64_t pairs = 0, last_us = 0;
    for (const StereoFrame& frame : frames) {
      EXPECT_GT(frame.utime(), last_us);
      last_us = frame.utime();
      if (frame.left) {
        EXPECT_TRUE(seen_left.insert(frame.left->sequence).second);
      }
      if (frame.right) {
        EXPECT_TRUE(seen_right.insert(frame.right->sequence).second);
      }
      if (!frame.is_pair()) continue;
      EXPECT_EQ(frame.left->sequence, frame.right->sequence);
      ++pairs;
    }
    EXPECT_EQ(seen_left, left);
    EXPECT_EQ(seen_right, right);
    std::vector<std::int64_t> both;
    std::set_intersection(left.begin(), left.end(), right.begin(), right.end(), std::back_inserter(both));
    EXPECT_EQ(pairs, static_cast<std::int64_t>(both.size()));
    EXPECT_EQ(pairing.counts().pairs, pairs);
    EXPECT_EQ(pairing.counts().left_alone, static_cast<std::int64_t>(left.size()) - pairs);
    EXPECT_EQ(pairing.counts().right_alone, static_cast<std::int64_t>(right.size()) - pairs);
    EXPECT_EQ(pairing.counts().late, 0);
  }
}

TEST(StereoPairing, NoHeapCall) {
  if (!test::counts_allocations()) GTEST_SKIP() << "a sanitizer owns the heap";
  StereoPairing pairing({5000, 20'000});
  StereoFrame frame;
  const auto before = test::allocations();
  int taken = 0, put = 0;
  for (std::int64_t i = 1; i <= 50; ++i) {
    put += pairing.put(Side::kLeft, {i * kPeriod_us, 0}, i * kPeriod_us) ? 1 : 0;
    if (i % 3 != 0) put += pairing.put(Side::kRight, {i * kPeriod_us, 0}, i * kPeriod_us) ? 1 : 0;
    while (pairing.take(i * kPeriod_us + 20'000, &frame)) ++taken;
  }
  EXPECT_EQ(test::allocations() - before, 0U);
  EXPECT_EQ(taken, 50);
  EXPECT_EQ(put, 84);
}

}  // namespace
}  // namespace farpoint::drivers
