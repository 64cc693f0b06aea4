// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping_port.h"

#include <gtest/gtest.h>

namespace farpoint::slam {
namespace {

EstimatorConfig small_config() {
  EstimatorConfig config;
  config.extractor.features = 10;
  config.capacity.landmarks = 10;
  config.mapping.quick_view_delay_ms = 50;
  config.mapping.full_view_delay_ms = 150;
  return config;
}

class MappingPortTest : public ::testing::Test {
 protected:
  // Frames are 50 ms apart.
  static std::int64_t time_of(std::uint64_t frame_number) {
    return 50'000 * static_cast<std::int64_t>(frame_number);
  }
  // Sends a job for this frame; false where the port has no room.
  bool send(std::uint64_t frame_number) {
    MappingJob* job = port_.begin_job(MappingJobKind::kKeyframe, {frame_number, time_of(frame_number), 1});
    if (job == nullptr) return false;
    port_.send_job();
    return true;
  }
  // Mapping's part: replies to the oldest job.
  void reply(MappingStage stage, bool ends_job) {
    const MappingJob* job = rings_.jobs.front();
    ASSERT_NE(job, nullptr);
    MappingReply* slot = rings_.replies.begin_push();
    ASSERT_NE(slot, nullptr);
    *slot = {};
    slot->number = ++replies_;
    slot->job_number = job->number;
    slot->utime = job->utime;
    slot->stage = stage;
    slot->ends_job = ends_job;
    rings_.replies.end_push();
    if (ends_job) rings_.jobs.pop();
  }
  // Numbers of the replies that this frame takes.
  [[nodiscard]] std::vector<std::uint64_t> take(std::uint64_t frame_number, const ReplyLimit& limit = {}) {
    std::vector<std::uint64_t> out;
    while (const MappingReply* reply = port_.take_reply(time_of(frame_number), limit)) {
      out.push_back(reply->number);
      port_.release_reply();
    }
    return out;
  }
  using Numbers = std::vector<std::uint64_t>;

  EstimatorConfig config_ = small_config();
  MappingRings rings_{config_};
  MappingPort port_{config_.mapping, &rings_};
  std::uint64_t replies_ = 0;
};

TEST_F(MappingPortTest, AJobNamesTheFrameThatSentIt) {
  ASSERT_NE(port_.begin_job(MappingJobKind::kRetireMap, {7, 700, 3}), nullptr);
  EXPECT_EQ(rings_.jobs.front(), nullptr) << "begun, not sent";
  EXPECT_EQ(port_.send_job(), 1U);
  const MappingJob* job = rings_.jobs.front();
  ASSERT_NE(job, nullptr);
  EXPECT_EQ(job->kind, MappingJobKind::kRetireMap);
  EXPECT_EQ(job->number, 1U);
  EXPECT_EQ(job->frame_number, 7U);
  EXPECT_EQ(job->utime, 700);
  EXPECT_EQ(job->map_id, 3);
}

TEST_F(MappingPortTest, TakesEachReplyOnceAndInOrder) {
  send(5);
  reply(MappingStage::kQuick, false);
  reply(MappingStage::kFull, true);
  EXPECT_EQ(take(9), (Numbers{1, 2}));
  EXPECT_EQ(take(9), Numbers{});
  EXPECT_EQ(port_.replies_taken(), 2U);
}

TEST_F(MappingPortTest, LockstepTakesAReplyItsDelayAfterTheJobsFrame) {
  send(5);
  reply(MappingStage::kQuick, false);
  reply(MappingStage::kFull, true);
  EXPECT_EQ(take(5), Numbers{});
  EXPECT_EQ(take(6), Numbers{1});
  EXPECT_EQ(take(7), Numbers{});
  EXPECT_EQ(take(8), Numbers{2});
}

TEST_F(MappingPortTest, LockstepTakesDoneJobsWithinTheFrameAndAFirstViewAfterTheQuickDelay) {
  send(5);
  reply(MappingStage::kStarted, true);
  send(5);
  reply(MappingStage::kDone, true);
  EXPECT_EQ(take(5), Numbers{}) << "replies keep their order";
  EXPECT_EQ(take(6), (Numbers{1, 2}));
}

TEST_F(MappingPortTest, ThreadsTakeRepliesUpToTheGivenNumber) {
  send(5);
  reply(MappingStage::kQuick, false);
  reply(MappingStage::kFull, true);
  EXPECT_EQ(take(0, {.by_delay = false, .up_to = 1}), Numbers{1});
  EXPECT_EQ(take(0, {.by_delay = false}), Numbers{2});
}

TEST_F(MappingPortTest, AReplyThatWasReleasedKeepsNoView) {
  send(5);
  reply(MappingStage::kFull, true);
  const auto view = std::make_shared<const LocalView>();
  rings_.replies.front()->view = view;
  EXPECT_EQ(take(9).size(), 1U);
  EXPECT_EQ(view.use_count(), 1);
}

TEST_F(MappingPortTest, MappingIsBusyUntilTheReplyThatEndsTheJobIsTaken) {
  EXPECT_TRUE(port_.is_free());
  send(5);
  EXPECT_FALSE(port_.is_free());
  reply(MappingStage::kQuick, false);
  reply(MappingStage::kFull, true);
  EXPECT_EQ(take(6), Numbers{1});
  EXPECT_FALSE(port_.is_free());
  EXPECT_EQ(take(8), Numbers{2});
  EXPECT_TRUE(port_.is_free());
}

TEST_F(MappingPortTest, RepliesOfAMapThatWasGivenUpAreToldFromThoseOfTheNext) {
  send(5);
  port_.give_up_map();
  send(6);
  reply(MappingStage::kDone, true);
  reply(MappingStage::kDone, true);
  const MappingReply* old = port_.take_reply(time_of(9), {});
  ASSERT_NE(old, nullptr);
  EXPECT_FALSE(port_.is_of_present_map(*old));
  port_.release_reply();
  const MappingReply* present = port_.take_reply(time_of(9), {});
  ASSERT_NE(present, nullptr);
  EXPECT_TRUE(port_.is_of_present_map(*present));
}

TEST_F(MappingPortTest, SendsNoMoreJobsThanTheirRepliesHaveRoom) {
  for (std::size_t i = 0; i < MappingRings::kJobs; ++i) ASSERT_TRUE(send(5));
  EXPECT_FALSE(send(5));
  // Worked on, with the most replies a job has, and none taken: still no room.
  for (std::size_t i = 0; i < MappingRings::kJobs; ++i) {
    reply(MappingStage::kQuick, false);
    reply(MappingStage::kFull, true);
  }
  EXPECT_FALSE(send(5));
  EXPECT_EQ(port_.jobs_under_way(), MappingRings::kJobs);
  EXPECT_EQ(take(9).size(), MappingRings::kReplies);
  EXPECT_TRUE(send(9));
}

TEST_F(MappingPortTest, SaysWhenAFrameCannotBeRecorded) {
  for (std::size_t i = 0; i < MappingRings::kRecords; ++i) ASSERT_TRUE(port_.record({}));
  EXPECT_FALSE(port_.record({}));
  rings_.recorded.pop();
  EXPECT_TRUE(port_.record({}));
}

}  // namespace
}  // namespace farpoint::slam
