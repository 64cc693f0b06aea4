// SPDX-License-Identifier: Apache-2.0
#include "slam/back_end.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "tests/support/point_world.h"

namespace farpoint::slam {
namespace {

using test::PointWorld;

class BackEndTest : public ::testing::Test {
 protected:
  MappingJob* begin(MappingJobKind kind, std::int32_t map_id = 1) {
    MappingJob* job = rings.jobs.begin_push();
    job->kind = kind;
    job->number = ++jobs;
    job->frame_number = 10 + jobs;
    job->utime = static_cast<std::int64_t>(1000 * jobs);
    job->map_id = map_id;
    return job;
  }
  void send_start(std::int32_t map_id = 1) {
    begin(MappingJobKind::kStartMap, map_id)->pair = world.initial_pair(world.frame(0), world.frame(1));
    rings.jobs.end_push();
  }
  void send_keyframe(int step, const LocalView& view) {
    begin(MappingJobKind::kKeyframe)->keyframe = world.keyframe_request(step, view);
    rings.jobs.end_push();
  }
  void send(MappingJobKind kind, std::int32_t map_id) {
    begin(kind, map_id);
    rings.jobs.end_push();
  }
  // One step, whose reply is handed over and taken.
  MappingReply step() {
    if (!side.step()) {
      ADD_FAILURE() << "no job";
      return {};
    }
    side.hand_over();
    MappingReply reply = *rings.replies.front();
    rings.replies.front()->view.reset();
    rings.replies.pop();
    return reply;
  }
  std::shared_ptr<const LocalView> started(std::int32_t map_id = 1) {
    send_start(map_id);
    return step().view;
  }
  void record(std::int64_t utime, std::int32_t map_id, std::uint64_t reference_id) {
    EXPECT_TRUE(rings.recorded.push({utime, map_id, reference_id, SE3{}}));
  }

  PointWorld world;
  const EstimatorConfig config = test::small_config();
  MappingRings rings{config};
  BackEnd side{config, world.rig(), &rings};
  std::uint64_t jobs = 0;
};

TEST_F(BackEndTest, DoesNothingWithoutAJob) {
  EXPECT_FALSE(side.step());
  EXPECT_EQ(rings.replies.front(), nullptr);
}

TEST_F(BackEndTest, StartOfAMapIsOneReplyWithItsView) {
  send_start(3);
  ASSERT_TRUE(side.step());
  EXPECT_EQ(rings.replies.front(), nullptr) << "handed over too early";
  EXPECT_EQ(side.reply().stage, MappingStage::kStarted);
  side.hand_over();
  const MappingReply* reply = rings.replies.front();
  ASSERT_NE(reply, nullptr);
  EXPECT_EQ(reply->number, 1U);
  EXPECT_EQ(reply->job_number, 1U);
  EXPECT_EQ(reply->frame_number, 11U);
  EXPECT_EQ(reply->utime, 1000);
  EXPECT_TRUE(reply->ends_job);
  ASSERT_TRUE(reply->view);
  EXPECT_EQ(reply->view->map_id, 3);
  EXPECT_EQ(reply->keyframes, 2U);
  EXPECT_EQ(reply->landmarks, side.mapper().map().landmarks().size());
  EXPECT_EQ(reply->counts.keyframes_made, 2U);
  EXPECT_EQ(rings.jobs.front(), nullptr);
}

TEST_F(BackEndTest, MapThatDoesNotHoldIsAReplyWithoutAView) {
  MappingJob* job = begin(MappingJobKind::kStartMap);
  job->pair = world.initial_pair(world.frame(0), world.frame(1));
  job->pair.points.resize(10);
  rings.jobs.end_push();
  const MappingReply reply = step();
  EXPECT_EQ(reply.stage, MappingStage::kStarted);
  EXPECT_FALSE(reply.view);
  EXPECT_TRUE(reply.ends_job);
  EXPECT_EQ(reply.keyframes, 0U);
}

TEST_F(BackEndTest, KeyframeIsAQuickReplyThenAFullOne) {
  const auto view = started();
  ASSERT_TRUE(view);
  send_keyframe(2, *view);
  const MappingReply quick = step();
  EXPECT_EQ(quick.stage, MappingStage::kQuick);
  EXPECT_FALSE(quick.ends_job);
  EXPECT_NE(rings.jobs.front(), nullptr) << "the job ended with its first reply";
  const MappingReply full = step();
  EXPECT_EQ(full.stage, MappingStage::kFull);
  EXPECT_TRUE(full.ends_job);
  EXPECT_EQ(rings.jobs.front(), nullptr);
  EXPECT_EQ(quick.number, 2U);
  EXPECT_EQ(full.number, 3U);
  EXPECT_EQ(quick.job_number, 2U);
  EXPECT_EQ(full.job_number, 2U);
  ASSERT_TRUE(quick.view && full.view);
  EXPECT_EQ(quick.view->reference_id, 3U);
  EXPECT_EQ(full.view->reference_id, 3U);
  EXPECT_EQ(full.counts.local_ba, quick.counts.local_ba + 1);
  // The next keyframe begins with its quick reply again.
  send_keyframe(3, *full.view);
  EXPECT_EQ(step().stage, MappingStage::kQuick);
}

TEST_F(BackEndTest, UnusableKeyframeIsOneReplyWithoutAView) {
  const auto view = started();
  LocalView unknown = *view;
  unknown.reference_id = 77;
  send_keyframe(2, unknown);
  const MappingReply reply = step();
  EXPECT_EQ(reply.stage, MappingStage::kDone);
  EXPECT_TRUE(reply.ends_job);
  EXPECT_FALSE(reply.view);
  EXPECT_EQ(rings.jobs.front(), nullptr);
  send_keyframe(2, *view);
  EXPECT_EQ(step().stage, MappingStage::kQuick);
}

TEST_F(BackEndTest, EndedJobHoldsNoFramesAndViews) {
  const auto view = started();
  MappingJob* job = begin(MappingJobKind::kPoseFrames);
  const auto frame = world.frame(2);
  job->keyframe.frame = job->pair.first = job->pair.second = frame;
  job->frames.push_back(frame);
  job->view = view;
  rings.jobs.end_push();
  step();
  EXPECT_EQ(frame.use_count(), 1);
  EXPECT_EQ(view.use_count(), 2);  // this one and the pool's
}

TEST_F(BackEndTest, DiscardedMapTakesItsRecordedFramesAlong) {
  ASSERT_TRUE(started(1));
  ASSERT_TRUE(started(2));
  record(1, 1, 1), record(2, 2, 3), record(3, 1, 2);
  send(MappingJobKind::kDiscardMap, 1);
  const MappingReply reply = step();
  EXPECT_EQ(reply.stage, MappingStage::kDone);
  EXPECT_TRUE(reply.ends_job);
  EXPECT_EQ(reply.keyframes, 2U);
  ASSERT_EQ(side.recorded().size(), 1U);
  EXPECT_EQ(side.recorded().front().utime, 2);
}

TEST_F(BackEndTest, RetiredMapStaysWithoutPixels) {
  ASSERT_TRUE(started());
  send(MappingJobKind::kRetireMap, 1);
  EXPECT_EQ(step().keyframes, 2U);
  side.mapper().map().keyframes().for_each(
      [](KeyframeHandle, const Keyframe& k) { EXPECT_FALSE(k.has_pixels()); });
}

TEST_F(BackEndTest, RecordsNothingWithoutTheWholeTrajectory) {
  EstimatorConfig endless = config;
  endless.capacity.whole_trajectory = false;
  BackEnd other(endless, world.rig(), &rings);
  record(1, 1, 1);
  other.collect_recorded();
  EXPECT_TRUE(other.recorded().empty());
  EXPECT_EQ(rings.recorded.front(), nullptr);
}

// Frames from before and after the pair are posed against the map's view, and recorded.
TEST_F(BackEndTest, PosesFramesFromBeforeTheMap) {
  const auto view = started();
  ASSERT_TRUE(view);
  record(0, 1, 1), record(100000, 1, 2);
  MappingJob* job = begin(MappingJobKind::kPoseFrames);
  const SE3 before{so3_exp({0.0, 0.0, -0.004}), {-0.05, -0.03, 0.01}};
  const SE3 after = PointWorld::pose(1) * SE3{so3_exp({0.0, 0.002, 0.0}), {0.04, 0.02, 0.0}};
  job->last_before_map = 4;
  const SE3 earlier = before * SE3{Eigen::Quaterniond::Identity(), {-0.05, -0.03, 0.01}};
  job->frames = {world.frame(earlier, 2), world.frame(before, 3), world.frame(after, 5)};
  job->view = view;
  rings.jobs.end_push();
  EXPECT_EQ(step().stage, MappingStage::kDone);
  ASSERT_EQ(side.recorded().size(), 5U);
  const auto pose_of = [&](std::size_t i) {
    SE3 T_world_reference;
    EXPECT_TRUE(side.mapper().map().pose_of(side.recorded()[i].reference_id, &T_world_reference));
    return T_world_reference * side.recorded()[i].T_reference_body();
  };
  // Backwards from the pair, then forwards.
  const std::vector<std::pair<std::int64_t, SE3>> expected{
      {300000, before}, {200000, earlier}, {500000, after}};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(side.recorded()[i + 2].utime, expected[i].first);
    EXPECT_LT(pose_of(i + 2).boxminus_to(expected[i].second).norm(), 5e-3);
  }
}

// The map has another unit since the view was made: the frames are posed in the view's, and follow.
TEST_F(BackEndTest, PosesFramesAgainstAViewInAnOlderUnit) {
  const auto view = started();
  ASSERT_TRUE(view);
  record(0, 1, 1), record(100000, 1, 2);
  MappingJob* job = begin(MappingJobKind::kPoseFrames);
  const SE3 before{so3_exp({0.0, 0.0, -0.004}), {-0.05, -0.03, 0.01}};
  job->last_before_map = 4;
  job->frames = {world.frame(before, 3)};
  job->view = view;
  rings.jobs.end_push();
  const Sim3 S{2.0, so3_exp({0.1, 0.2, 0.9}), {3, -2, 1}};
  side.transform_map(1, S);
  step();
  ASSERT_EQ(side.recorded().size(), 3U);
  Sim3 S_world_reference;
  ASSERT_TRUE(side.mapper().map().similarity_of(side.recorded()[2].reference_id, &S_world_reference));
  const SE3 T = S_world_reference * side.recorded()[2].T_reference_body();
  EXPECT_LT(T.boxminus_to(S * before).norm(), 1e-2);
}

TEST_F(BackEndTest, PosesNoFramesOfAMapThatHasGone) {
  const auto view = started();
  MappingJob* job = begin(MappingJobKind::kPoseFrames);
  job->frames = {world.frame(0)};
  job->view = view;
  rings.jobs.end_push();
  step();
  EXPECT_TRUE(side.recorded().empty());
}

}  // namespace
}  // namespace farpoint::slam
