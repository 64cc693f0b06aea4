// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping_rings.h"

#include <gtest/gtest.h>

namespace farpoint::slam {
namespace {

TEST(MappingJob, ClearGivesEverythingBackAndKeepsTheMemory) {
  const auto frame = std::make_shared<Frame>();
  const auto view = std::make_shared<const LocalView>();
  MappingJob job;
  job.pair.first = job.pair.second = job.keyframe.frame = frame;
  job.pair.points.resize(9);
  job.keyframe.sightings.resize(9);
  job.keyframe.counts.resize(9);
  job.frames.assign(9, frame);
  job.view = view;
  job.seen.resize(9);
  job.clear();
  EXPECT_EQ(frame.use_count(), 1);
  EXPECT_EQ(view.use_count(), 1);
  EXPECT_TRUE(job.pair.points.empty() && job.keyframe.sightings.empty() && job.keyframe.counts.empty() &&
              job.frames.empty() && job.seen.empty());
  EXPECT_EQ(job.pair.points.capacity(), 9U);
  EXPECT_EQ(job.keyframe.sightings.capacity(), 9U);
  EXPECT_EQ(job.keyframe.counts.capacity(), 9U);
  EXPECT_EQ(job.frames.capacity(), 9U);
  EXPECT_EQ(job.seen.capacity(), 9U);
}

TEST(MappingRings, EveryJobHasRoomForTheLargestAndBeginsEmpty) {
  EstimatorConfig config;
  config.extractor.features = 120;
  config.capacity.landmarks = 77;
  MappingRings rings(config);
  for (std::size_t i = 0; i < MappingRings::kJobs; ++i) {
    const MappingJob* job = rings.jobs.begin_push();
    ASSERT_NE(job, nullptr);
    EXPECT_TRUE(job->pair.points.empty() && job->keyframe.counts.empty() && job->frames.empty());
    EXPECT_GE(job->pair.points.capacity(), 120U);
    EXPECT_GE(job->keyframe.sightings.capacity(), 120U);
    EXPECT_GE(job->seen.capacity(), 120U);
    EXPECT_GE(job->keyframe.counts.capacity(), 77U);
    rings.jobs.end_push();
  }
  EXPECT_EQ(rings.jobs.begin_push(), nullptr);
}

TEST(SpscRing, RefusesWhatItHasNoRoomForAndKeepsTheRest) {
  SpscRing<int> ring(3);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(ring.push(i));
  EXPECT_FALSE(ring.push(3));
  EXPECT_EQ(ring.size(), 3U);
  for (int i = 0; i < 3; ++i) {
    ASSERT_NE(ring.front(), nullptr);
    EXPECT_EQ(*ring.front(), i);
    ring.pop();
  }
  EXPECT_EQ(ring.front(), nullptr);
  EXPECT_TRUE(ring.push(4));
  EXPECT_EQ(*ring.front(), 4);
}

TEST(KeptFrame, StandsWhereTheRecordedFrameStood) {
  RecordedFrame frame;
  frame.utime = 123;
  frame.map_id = 4;
  frame.reference_id = 56;
  frame.T_reference_body = {Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized())),
                            {10.0, -20.0, 0.5}};
  const KeptFrame kept(frame);
  EXPECT_EQ(kept.utime, 123);
  EXPECT_EQ(kept.map_id, 4);
  EXPECT_EQ(kept.reference_id, 56U);
  const SE3 T = kept.T_reference_body();
  EXPECT_LT((T.t - frame.T_reference_body.t).norm(), 1e-5);
  EXPECT_LT(T.q.angularDistance(frame.T_reference_body.q), 1e-5);
}

}  // namespace
}  // namespace farpoint::slam
