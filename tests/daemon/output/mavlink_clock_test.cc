// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/mavlink_clock.h"

#include <gtest/gtest.h>

#include <cstdlib>

namespace farpoint::daemon {
namespace {

constexpr std::int64_t kMilli_ns = 1'000'000, kSecond_ns = 1'000'000'000;

// One exchange that begins at `now_ns`, with an autopilot whose clock is ahead by `offset_ns`.
bool exchange(MavlinkClock* clock, std::int64_t now_ns, std::int64_t offset_ns, std::int64_t there_ns,
              std::int64_t back_ns) {
  const ipc::mavlink::Timesync request = clock->request(now_ns);
  EXPECT_EQ(request.tc1_ns, 0);
  return clock->take_answer({now_ns + there_ns + offset_ns, request.ts1_ns, 0, 0},
                            now_ns + there_ns + back_ns);
}

TEST(MavlinkClock, SpeaksInItsOwnTimeUntilTheAutopilotHasAnsweredOftenEnough) {
  MavlinkClock clock;
  const std::int64_t offset = -500 * kSecond_ns;
  for (int i = 0; i < MavlinkClock::kLeastAnswers; ++i) {
    EXPECT_FALSE(clock.knows_autopilot());
    EXPECT_EQ(clock.link_time_ns(777), 777);
    EXPECT_EQ(clock.round_trip_us(), -1);
    EXPECT_TRUE(exchange(&clock, (1000 + i) * kSecond_ns, offset, kMilli_ns, kMilli_ns));
  }
  EXPECT_TRUE(clock.knows_autopilot());
  EXPECT_EQ(clock.link_time_ns(1005 * kSecond_ns), 505 * kSecond_ns);
  EXPECT_EQ(clock.round_trip_us(), 2000);
}

TEST(MavlinkClock, TheShortestRoundTripCounts) {
  MavlinkClock clock;
  const std::int64_t offset = 42 * kSecond_ns;
  // Slow ways back pull the offset; one exchange is quick.
  for (int i = 0; i < 12; ++i)
    exchange(&clock, (10 + i) * kSecond_ns, offset, kMilli_ns, i == 5 ? kMilli_ns : 30 * kMilli_ns);
  EXPECT_EQ(clock.link_time_ns(0), offset);
  EXPECT_EQ(clock.round_trip_us(), 2000);
}

TEST(MavlinkClock, AnswersThatNobodyAskedForChangeNothing) {
  MavlinkClock clock;
  for (int i = 0; i < 20; ++i)
    EXPECT_FALSE(clock.take_answer({99 * kSecond_ns, 5 * kSecond_ns + i, 0, 0}, 6 * kSecond_ns));
  const ipc::mavlink::Timesync request = clock.request(7 * kSecond_ns);
  EXPECT_FALSE(clock.take_answer({-5, request.ts1_ns, 0, 0}, 7 * kSecond_ns));
  EXPECT_FALSE(clock.take_answer({INT64_MAX, request.ts1_ns, 0, 0}, 7 * kSecond_ns));
  // Too late, and an answer counts once.
  EXPECT_FALSE(
      clock.take_answer({99, request.ts1_ns, 0, 0}, 7 * kSecond_ns + MavlinkClock::kLongestRoundTrip_ns + 1));
  EXPECT_FALSE(clock.take_answer({99, request.ts1_ns, 0, 0}, 7 * kSecond_ns + 1));
  EXPECT_FALSE(clock.take_answer({99, 0, 0, 0}, 1));
  EXPECT_FALSE(clock.knows_autopilot());
}

TEST(MavlinkClock, AnAutopilotThatStartsAnewIsFollowedAndOneWrongAnswerIsNot) {
  MavlinkClock clock;
  std::int64_t now = 1000 * kSecond_ns;
  const auto answers = [&](int count, std::int64_t offset) {
    for (int i = 0; i < count; ++i, now += kSecond_ns) exchange(&clock, now, offset, kMilli_ns, kMilli_ns);
  };
  answers(8, 100 * kSecond_ns);
  answers(1, -900 * kSecond_ns);
  EXPECT_EQ(clock.link_time_ns(0), 100 * kSecond_ns);
  answers(1, 100 * kSecond_ns);
  answers(3, -950 * kSecond_ns);  // started anew
  EXPECT_FALSE(clock.knows_autopilot());
  answers(4, -950 * kSecond_ns);
  EXPECT_EQ(clock.link_time_ns(0), -950 * kSecond_ns);
}

// Clocks that run apart by 50 ppm, a link with a jitter of milliseconds: the error stays below half the
// shortest round trips.
TEST(MavlinkClock, DriftAndJitterAreFollowed) {
  MavlinkClock clock;
  std::uint64_t random = 7;
  const auto jitter = [&random] {
    random = random * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<std::int64_t>((random >> 40) % 8) * kMilli_ns;
  };
  for (int s = 0; s < 600; ++s) {
    const std::int64_t now = s * kSecond_ns + kSecond_ns, offset = 3 * kSecond_ns + now / 20'000;
    exchange(&clock, now, offset, kMilli_ns + jitter(), kMilli_ns + jitter());
    if (s <= 10) continue;
    EXPECT_LT(std::abs(clock.link_time_ns(now) - now - offset), 5 * kMilli_ns) << s;
  }
}

// An autopilot that converts stamps by its own exchanges, as PX4 does, must find no difference left.
TEST(MavlinkClock, AnswersToTheAutopilotAreInTheTimeOfTheStamps) {
  MavlinkClock clock;
  const ipc::mavlink::Timesync request{0, 31337, 0, 0};
  EXPECT_EQ(clock.answer(request, 5 * kSecond_ns).tc1_ns, 5 * kSecond_ns);
  for (int i = 0; i < 8; ++i) exchange(&clock, (10 + i) * kSecond_ns, 40 * kSecond_ns, kMilli_ns, kMilli_ns);
  const ipc::mavlink::Timesync answer = clock.answer(request, 20 * kSecond_ns);
  EXPECT_EQ(answer.tc1_ns, clock.link_time_ns(20 * kSecond_ns));
  EXPECT_EQ(answer.tc1_ns, 60 * kSecond_ns);
  EXPECT_EQ(answer.ts1_ns, 31337);
}

}  // namespace
}  // namespace farpoint::daemon
