// SPDX-License-Identifier: Apache-2.0
// Threaded replay of recordings: no heap on the threads that must not wait for it, and a run that repeats.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "daemon/replay.h"
#include "ipc/log.h"
#include "tests/ipc/allocations.h"
#include "tests/ipc/log_events.h"
#include "tests/ipc/scratch.h"
#include "tests/realtime/heap_watch.h"
#include "tests/replay/recordings.h"

namespace farpoint::daemon {
namespace {

namespace fs = std::filesystem;

// Faster than the camera, so that the test is short; frames may be dropped. Not for KITTI: a map that is lost
// because mapping has no time to follow is looked for anew, and that may use the heap.
constexpr double kFast = 4.0, kCameraSpeed = 1.0;

Options threaded(const test::Scratch& scratch, const std::string& log, double speed = kFast) {
  Options options;
  options.replay = log;
  options.speed = speed;
  options.output = scratch.path("out.lcm");
  options.trajectory = scratch.path("final.tum");
  options.live_trajectory = scratch.path("live.tum");
  options.can_log = scratch.path("out.candump");
  return options;
}

Config quiet_config() {
  Config config;
  config.realtime.lock_memory = false;  // a test machine may refuse
  return config;
}

// Watches from the first frame that tracks a settled map.
ThreadHooks watch_from_settled(bool* watched) {
  ThreadHooks hooks;
  hooks.on_output = [watched](const FrameOutput& frame) {
    if (*watched || frame.result.state != slam::State::kTracking) return;
    *watched = true;
    test::watch_heap();
  };
  return hooks;
}

void expect_no_heap_calls(const std::string& recording, double speed) {
  if (!fs::exists(test::kData)) GTEST_SKIP() << "no recordings in " << test::kData;
  if (!test::counts_allocations()) GTEST_SKIP() << "a sanitizer owns the heap";
  const test::Scratch scratch;
  const std::string log = scratch.path("run.lcm");
  ASSERT_TRUE(test::import_recording(recording, log));
  bool watched = false;
  const int status = replay(threaded(scratch, log, speed), quiet_config(), watch_from_settled(&watched));
  test::stop_watching_heap();
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(watched);
  std::uint64_t calls = 0;
  for (const char* name : {Pipeline::kCaptureThread, Pipeline::kTrackingThread, Pipeline::kOutputThread}) {
    EXPECT_EQ(test::heap_calls(name), 0U) << name;
    calls += test::heap_calls(name);
  }
  if (calls > 0) test::print_heap_calls();
  // The watch works: mapping does allocate.
  EXPECT_GT(test::heap_calls(Pipeline::kMappingThread), 0U);
}

TEST(RecordedThreads, NoHeapOnKittiAfterSettling) {
  expect_no_heap_calls("kitti {}/kitti 03", kCameraSpeed);
}

TEST(RecordedThreads, NoHeapOnEurocAfterSettling) {
  expect_no_heap_calls("euroc {}/euroc/MH_01_part", kFast);
}

TEST(RecordedThreads, APlantedMallocIsFound) {
  if (!fs::exists(test::kData)) GTEST_SKIP() << "no recordings in " << test::kData;
  if (!test::counts_allocations()) GTEST_SKIP() << "a sanitizer owns the heap";
  const test::Scratch scratch;
  const std::string log = scratch.path("run.lcm");
  ASSERT_TRUE(test::import_recording("euroc {}/euroc/MH_01_part", log));
  bool watched = false;
  ThreadHooks hooks = watch_from_settled(&watched);
  hooks.on_tracked = [](const slam::FrameResult&) {
    void* volatile planted = std::malloc(1);
    std::free(planted);
  };
  EXPECT_EQ(replay(threaded(scratch, log), quiet_config(), hooks), 0);
  test::stop_watching_heap();
  EXPECT_GT(test::heap_calls(Pipeline::kTrackingThread), 0U);
  EXPECT_EQ(test::heap_calls(Pipeline::kOutputThread), 0U);
}

void expect_same_file(const std::string& a, const std::string& b) {
  const auto left = test::read_bytes(a), right = test::read_bytes(b);
  EXPECT_FALSE(left.empty());
  EXPECT_TRUE(left == right) << a << " and " << b << " differ";
}

TEST(RecordedThreads, ARecordedScheduleRepeatsTheRun) {
  if (!fs::exists(test::kData)) GTEST_SKIP() << "no recordings in " << test::kData;
  const test::Scratch scratch;
  const std::string log = scratch.path("run.lcm");
  ASSERT_TRUE(test::import_recording("euroc {}/euroc/MH_01_part", log));
  const Options live = threaded(scratch, log);
  ASSERT_EQ(replay(live, quiet_config()), 0);
  Options again = live;
  again.speed.reset();
  again.schedule_log = live.output;
  again.output = scratch.path("again.lcm");
  again.trajectory = scratch.path("again_final.tum");
  again.live_trajectory = scratch.path("again_live.tum");
  again.can_log = scratch.path("again.candump");
  ASSERT_EQ(replay(again, quiet_config()), 0);
  expect_same_file(live.trajectory, again.trajectory);
  expect_same_file(live.live_trajectory, again.live_trajectory);
  expect_same_file(live.can_log, again.can_log);
  const auto before = test::events_of(live.output), after = test::events_of(again.output);
  ASSERT_EQ(before.size(), after.size());
  for (std::size_t i = 0; i < before.size(); ++i)
    ASSERT_TRUE(before[i] == after[i]) << "event " << i << ": " << before[i].substr(0, 40);
}

}  // namespace
}  // namespace farpoint::daemon
