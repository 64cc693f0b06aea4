// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/schedule.h"

#include <gtest/gtest.h>

#include "daemon/config/rig.h"
#include "ipc/channels.h"
#include "ipc/log.h"
#include "tests/ipc/scratch.h"

namespace farpoint::daemon {
namespace {

void write_schedule(const std::string& path, const std::vector<schedule_t>& messages) {
  ipc::LogWriter log(path);
  for (const schedule_t& m : messages) ASSERT_TRUE(log.write_message(ipc::kScheduleChannel, m.utime, m));
  log.close();
}

schedule_t message(std::int64_t utime, std::int64_t replies, std::int64_t job) {
  schedule_t m{};
  m.utime = utime;
  m.replies_taken = replies;
  m.job = job;
  m.frames_dropped = 3;
  m.age_us = 4000;
  m.features_asked = 960;
  m.capture_queue = 1;
  m.publish_queue = 2;
  return m;
}

slam::FrameResult result(std::uint64_t replies, std::uint64_t job) {
  slam::FrameResult r;
  r.taken.replies = replies;
  r.job = job;
  return r;
}

TEST(Schedule, GivesWhatEachFrameMetAndKnowsTheDropped) {
  const test::Scratch scratch;
  write_schedule(scratch.path("s.lcm"), {message(100, 0, 1), message(300, 2, 0)});
  Schedule schedule(scratch.path("s.lcm"));
  const RecordedChance* first = schedule.take(100);
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(first->taken.replies, 0U);
  EXPECT_EQ(first->chance.frames_dropped, 3);
  EXPECT_EQ(first->chance.age_us, 4000);
  EXPECT_EQ(first->chance.features_asked, 960);
  EXPECT_EQ(first->chance.capture_queue, 1);
  EXPECT_EQ(first->chance.publish_queue, 2);
  EXPECT_NO_THROW(schedule.check(result(0, 1)));
  EXPECT_EQ(schedule.take(200), nullptr);
  EXPECT_THROW(schedule.check_end(), InputError);
  ASSERT_NE(schedule.take(300), nullptr);
  EXPECT_NO_THROW(schedule.check_end());
  EXPECT_EQ(schedule.take(400), nullptr);
}

TEST(Schedule, RefusesAnotherRecordingAnotherRunAndNothing) {
  const test::Scratch scratch;
  write_schedule(scratch.path("s.lcm"), {message(100, 2, 0), message(300, 2, 0)});
  Schedule schedule(scratch.path("s.lcm"));
  EXPECT_THROW((void)schedule.take(150), InputError);
  ASSERT_NE(schedule.take(100), nullptr);
  EXPECT_THROW(schedule.check(result(1, 0)), InputError);
  EXPECT_THROW(schedule.check(result(2, 7)), InputError);
  write_schedule(scratch.path("empty.lcm"), {});
  EXPECT_THROW(Schedule(scratch.path("empty.lcm")), InputError);
  EXPECT_THROW(Schedule("/nonexistent.lcm"), InputError);
  EXPECT_THROW(Schedule("-"), InputError);
}

TEST(Schedule, GivesTheSamplesAFrameTookAndRefusesOtherNumbers) {
  const test::Scratch scratch;
  schedule_t m = message(100, 0, 0);
  m.imu_taken = 40;
  m.wheels_taken = 3;
  write_schedule(scratch.path("s.lcm"), {m});
  Schedule schedule(scratch.path("s.lcm"));
  const RecordedChance* recorded = schedule.take(100);
  ASSERT_NE(recorded, nullptr);
  EXPECT_EQ(recorded->taken.imu, 40U);
  EXPECT_EQ(recorded->taken.wheels, 3U);
  slam::FrameResult r = result(0, 0);
  r.taken = {0, 40, 3};
  EXPECT_NO_THROW(schedule.check(r));
  r.taken = {0, 39, 3};
  EXPECT_THROW(schedule.check(r), InputError);
  r.taken = {0, 40, 4};
  EXPECT_THROW(schedule.check(r), InputError);
}

TEST(Schedule, RefusesARunThatDroppedSamples) {
  const test::Scratch scratch;
  schedule_t m = message(100, 0, 0);
  m.samples_dropped = 1;
  write_schedule(scratch.path("s.lcm"), {m});
  EXPECT_THROW(Schedule(scratch.path("s.lcm")), InputError);
}

}  // namespace
}  // namespace farpoint::daemon
