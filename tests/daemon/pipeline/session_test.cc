// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/session.h"

#include "ipc/channels.h"
#include "tests/daemon/pipeline/session_fixture.h"

namespace farpoint::daemon {
namespace {

class SessionTest : public SessionFixture {
 protected:
  const FrameOutput& process(int number, const RecordedChance* recorded = nullptr) {
    image_ = grey(number);
    clock_.new_frame();
    InputCounts in;
    in.images = number + 1;
    return session_->process(
        {1'000'000 + number * 100'000, number, 0,
         slam::ImageView{image_.data(), image_.width_px, image_.height_px, image_.width_px}},
        in, out_, recorded, &clock_);
  }

  OutputCounts out_;
  ipc::GreyImage image_;
  StageClock clock_;
};

TEST_F(SessionTest, HandsEachFrameToTheSinksOnceAndInOrder) {
  for (int i = 0; i < 6; ++i) process(i);
  ASSERT_EQ(sink_.frames.size(), 6U);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(sink_.frames[static_cast<std::size_t>(i)].result.sequence, i);
  EXPECT_EQ(kept_.of<odometry_t>(ipc::kOdometryChannel).size(), 6U);
  EXPECT_GT(clock_.wall_ms(timing_t::STAGE_FRAME), 0.0);
}

TEST_F(SessionTest, TheEndIsKnownFromTheFramesAlone) {
  for (int i = 0; i < 30; ++i) process(i);
  const RunEnd& end = session_->end();
  EXPECT_EQ(end.frames, 30);
  EXPECT_EQ(end.first_utime, 1'000'000);
  EXPECT_EQ(end.utime, 3'900'000);
  EXPECT_EQ(end.counts.frames, 30U);
  EXPECT_EQ(end.counts.maps, 1U);
  EXPECT_GT(end.initialised_utime, 1'000'000);
  EXPECT_LT(end.initialised_utime, 3'900'000);
  EXPECT_EQ(end.live_utimes.size(), static_cast<std::size_t>(end.frames_valid));
}

TEST_F(SessionTest, TheStatusHoldsTheCountsOfInputsAndOutputsAsOfTheFrame) {
  for (int i = 0; i < 12; ++i) {
    out_.can_send_errors = 100 + i;
    process(i);
  }
  const auto statuses = kept_.of<status_t>(ipc::kStatusChannel);
  ASSERT_GE(statuses.size(), 3U);
  for (const status_t& status : statuses) {
    const std::int64_t number = (status.utime - 1'000'000) / 100'000;
    EXPECT_EQ(status.frames_received, number + 1);
    EXPECT_EQ(status.can_send_errors, 100 + number);
    EXPECT_EQ(status.frames_tracked, number + 1);
    EXPECT_EQ(status.boot_counter, 7);
  }
}

TEST_F(SessionTest, TheMapIsPublishedWithAFrameThatHasTakenIt) {
  for (int i = 0; i < 30; ++i) process(i);
  EXPECT_FALSE(kept_.of<map_t>(ipc::kMapChannel).empty());
}

TEST_F(SessionTest, FinishPublishesTheRunsResultsWithWhatWasRefused) {
  for (int i = 0; i < 80; ++i) process(i);
  InputCounts in;
  in.times_backwards = 4, in.undecodable = 5;
  const RunEnd& end = session_->finish(in);
  EXPECT_EQ(end.counts.frames, 80U);
  EXPECT_GT(end.counts.mapping.keyframes_made, 1U);
  EXPECT_EQ(end.landmarks.size(), end.counts.landmarks);
  EXPECT_EQ(kept_.of<trajectory_t>(ipc::kTrajectoryChannel).size(), 1U);
  std::vector<double> published, expected;
  for (const landmarks_t& m : kept_.of<landmarks_t>(ipc::kLandmarksChannel))
    for (const landmark_t& l : m.landmarks) published.push_back(l.distance);
  for (const slam::LandmarkInfo& l : end.landmarks)
    if (l.full && l.inverse_depth > 0.0) expected.push_back(1.0 / l.inverse_depth);
  EXPECT_GT(end.landmarks.size(), 500U) << "in several messages";
  EXPECT_EQ(published, expected);
  const auto summary = kept_.of<summary_t>(ipc::kSummaryChannel);
  ASSERT_EQ(summary.size(), 1U);
  EXPECT_EQ(summary[0].times_backwards, 4);
  EXPECT_EQ(summary[0].images_undecodable, 5);
  EXPECT_EQ(summary[0].calibration_hash, "calibration");
  EXPECT_EQ(summary[0].keyframes_made, static_cast<std::int64_t>(end.counts.mapping.keyframes_made));
}

TEST_F(SessionTest, ARecordedFrameTakesNoMoreOfMappingThanItTookThen) {
  RecordedChance nothing_taken;
  nothing_taken.chance.features_asked = 400;
  for (int i = 0; i < 30; ++i) {
    const FrameOutput& frame = process(i, &nothing_taken);
    EXPECT_EQ(frame.result.taken.replies, 0U);
    EXPECT_EQ(frame.result.state, slam::State::kInitialising);
  }
  RecordedChance first_view = nothing_taken;
  first_view.taken.replies = 1;
  first_view.chance.age_us = 1234;
  const FrameOutput& frame = process(30, &first_view);
  EXPECT_EQ(frame.result.taken.replies, 1U);
  EXPECT_EQ(frame.age_us, 1234);
}

}  // namespace
}  // namespace farpoint::daemon
