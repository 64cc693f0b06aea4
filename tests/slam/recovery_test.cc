// SPDX-License-Identifier: Apache-2.0
#include "slam/recovery.h"

#include <gtest/gtest.h>

namespace farpoint::slam {
namespace {

constexpr std::int64_t kInterval_us = 100'000;
using Search = Recovery::Search;
using Verdict = Recovery::Verdict;

// Of a map that has settled.
class RecoveryTest : public ::testing::Test {
 protected:
  // Frames at the camera's pace, each tracked.
  void track(int frames) {
    for (int i = 0; i < frames; ++i) {
      utime_ += kInterval_us;
      recovery_.note_tracked();
      recovery_.note_seen(utime_);
    }
  }
  [[nodiscard]] std::int64_t after(int frames) const { return utime_ + frames * kInterval_us; }

  // Frames searched in vain until the map is given up; 0 where that does not happen within `most`.
  [[nodiscard]] int lose_until_given_up(int most, std::int64_t interval_us, Verdict* verdict) {
    for (int i = 1; i <= most; ++i) {
      utime_ += interval_us;
      *verdict = recovery_.note_lost(utime_);
      if (*verdict != Verdict::kSearchOn) return i;
    }
    return 0;
  }

  RecoveryTest() { recovery_.note_settled(); }

  Recovery recovery_;
  std::int64_t utime_ = 0;
};

TEST_F(RecoveryTest, TracksAtThePaceOfTheCamera) {
  track(3);
  EXPECT_EQ(recovery_.search(State::kTracking, after(1)), Search::kTrack);
  EXPECT_EQ(recovery_.search(State::kTracking, after(4)), Search::kTrack);
}

TEST_F(RecoveryTest, SearchesAfterAGapOfMoreThanFourFrames) {
  track(3);
  EXPECT_EQ(recovery_.search(State::kTracking, after(4) + 1), Search::kRelocalise);
}

TEST_F(RecoveryTest, LearnsASlowerPaceAtOnceAndADoubledFrameIsNone) {
  track(3);
  utime_ = after(2);
  recovery_.note_seen(utime_);
  EXPECT_EQ(recovery_.search(State::kTracking, after(8)), Search::kTrack);
  recovery_.note_seen(++utime_);
  EXPECT_EQ(recovery_.search(State::kTracking, after(6)), Search::kTrack);
}

TEST_F(RecoveryTest, SearchesWhileItIsLost) {
  track(3);
  EXPECT_EQ(recovery_.search(State::kLost, after(1)), Search::kRelocalise);
  EXPECT_EQ(recovery_.search(State::kRelocalising, after(1)), Search::kRelocalise);
}

TEST_F(RecoveryTest, ACandidateIsConfirmedByTheNextFrameAndLastsForOne) {
  track(3);
  recovery_.set_candidate({utime_, 4, 17, SE3{}});
  EXPECT_EQ(recovery_.search(State::kRelocalising, after(1)), Search::kConfirm);
  const std::optional<RecordedFrame> candidate = recovery_.take_candidate();
  ASSERT_TRUE(candidate);
  EXPECT_EQ(candidate->reference_id, 17U);
  EXPECT_FALSE(recovery_.take_candidate());
  EXPECT_EQ(recovery_.search(State::kRelocalising, after(1)), Search::kRelocalise);
}

TEST_F(RecoveryTest, ACandidateIsNotConfirmedAfterAGap) {
  track(3);
  recovery_.set_candidate({utime_, 4, 17, SE3{}});
  EXPECT_EQ(recovery_.search(State::kRelocalising, after(5)), Search::kRelocalise);
}

TEST_F(RecoveryTest, IsLostAtTheFirstFrameAndRelocalisesFromTheSecond) {
  track(3);
  (void)recovery_.note_lost(after(1));
  EXPECT_EQ(recovery_.state(), State::kLost);
  (void)recovery_.note_lost(after(2));
  EXPECT_EQ(recovery_.state(), State::kRelocalising);
  recovery_.note_tracked();
  (void)recovery_.note_lost(after(4));
  EXPECT_EQ(recovery_.state(), State::kLost);
}

TEST_F(RecoveryTest, GivesAMapUpAfterFifteenFramesAndOneAndAHalfSeconds) {
  Verdict verdict = Verdict::kSearchOn;
  EXPECT_EQ(lose_until_given_up(100, kInterval_us, &verdict), 17);
  EXPECT_EQ(verdict, Verdict::kRetireMap);
}

TEST_F(RecoveryTest, GivesASlowCameraAsManyFramesAndAFastOneAsMuchTime) {
  Verdict verdict = Verdict::kSearchOn;
  EXPECT_EQ(lose_until_given_up(100, 1'000'000, &verdict), 16);
  recovery_.begin_map();
  recovery_.note_settled();
  EXPECT_EQ(lose_until_given_up(100, kInterval_us / 5, &verdict), 77);
}

TEST_F(RecoveryTest, CountsOnlyFramesLostInARow) {
  Verdict verdict = Verdict::kSearchOn;
  EXPECT_EQ(lose_until_given_up(16, kInterval_us, &verdict), 0);
  recovery_.note_tracked();
  EXPECT_EQ(lose_until_given_up(16, kInterval_us, &verdict), 0);
}

TEST_F(RecoveryTest, DiscardsAMapThatNeverSettledAndKeepsOneThatEverDid) {
  recovery_.begin_map();
  EXPECT_EQ(recovery_.note_lost(100), Verdict::kDiscardMap);
  recovery_.begin_map();
  recovery_.note_settled();
  EXPECT_EQ(recovery_.note_lost(200), Verdict::kSearchOn);
}

TEST_F(RecoveryTest, ANewMapIsNotLost) {
  track(3);
  (void)recovery_.note_lost(after(1));
  recovery_.set_candidate({});
  recovery_.begin_map();
  EXPECT_FALSE(recovery_.take_candidate());
  (void)recovery_.note_lost(after(2));
  EXPECT_EQ(recovery_.state(), State::kLost);
}

}  // namespace
}  // namespace farpoint::slam
