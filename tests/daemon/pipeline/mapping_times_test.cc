// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/mapping_times.h"

#include <gtest/gtest.h>

#include <vector>

namespace farpoint::daemon {
namespace {

using slam::Stage;

class MappingTimesTest : public testing::Test {
 protected:
  // One reply of mapping with these stages, then its hand-over.
  void reply(const std::vector<Stage>& stages) {
    {
      const slam::StageSpan all(&times_, Stage::kMapping);
      for (const Stage stage : stages) const slam::StageSpan span(&times_, stage);
    }
    times_.hand_over();
  }
  // What the next frame's clock has of a stage; negative: it did not run.
  StageClock taken() {
    StageClock clock;
    times_.add_to(&clock);
    return clock;
  }

  MappingTimes times_;
};

TEST_F(MappingTimesTest, AKeyframesTwoRepliesAreHandedOverTogether) {
  reply({Stage::kTriangulation});
  EXPECT_LT(taken().cpu_ms(timing_t::STAGE_MAPPING), 0.0);
  reply({Stage::kFusing, Stage::kLocalBa, Stage::kCulling});
  const StageClock clock = taken();
  for (const int stage : std::initializer_list<int>{timing_t::STAGE_MAPPING, timing_t::STAGE_TRIANGULATION,
                                                    timing_t::STAGE_FUSING, timing_t::STAGE_LOCAL_BA,
                                                    timing_t::STAGE_CULLING}) {
    EXPECT_GE(clock.cpu_ms(stage), 0.0) << stage;
    EXPECT_GE(clock.wall_ms(stage), 0.0) << stage;
  }
  EXPECT_LT(taken().cpu_ms(timing_t::STAGE_MAPPING), 0.0) << "handed over once";
}

TEST_F(MappingTimesTest, JobsWithoutNewPointsAreHandedOverAtOnce) {
  reply({});
  EXPECT_GE(taken().cpu_ms(timing_t::STAGE_MAPPING), 0.0);
}

TEST_F(MappingTimesTest, TrackingsStagesHaveNoEffect) {
  times_.begin(Stage::kTracking);
  times_.begin(Stage::kPose);
  times_.end(Stage::kPose);
  times_.end(Stage::kTracking);
  reply({Stage::kLocalBa});
  const StageClock clock = taken();
  EXPECT_LT(clock.cpu_ms(timing_t::STAGE_TRACKING), 0.0);
  EXPECT_LT(clock.cpu_ms(timing_t::STAGE_POSE), 0.0);
}

TEST_F(MappingTimesTest, AFullRingKeepsTheTimesForLater) {
  constexpr int kReplies = 100;
  StageClock clock;
  clock.set(timing_t::STAGE_MAPPING, 1000.0, 1000.0);
  for (int i = 0; i < kReplies; ++i) reply({});
  times_.add_to(&clock);
  EXPECT_GT(clock.wall_ms(timing_t::STAGE_MAPPING), 1000.0) << "added to what is there";
  reply({});
  EXPECT_GE(taken().wall_ms(timing_t::STAGE_MAPPING), 0.0) << "those that found no room come too";
}

}  // namespace
}  // namespace farpoint::daemon
