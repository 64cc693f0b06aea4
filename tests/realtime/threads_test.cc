// SPDX-License-Identifier: Apache-2.0
// Threaded replay of recordings: no heap on the threads that must not wait for it, and a run that repeats.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/replay.h"
#include "ipc/image_codec.h"
#include "ipc/log.h"
#include "ipc/message.h"
#include "tests/ipc/allocations.h"
#include "tests/ipc/log_events.h"
#include "tests/ipc/scratch.h"
#include "tests/realtime/heap_watch.h"
#include "tests/replay/recordings.h"

namespace farpoint::daemon {
namespace {

namespace fs = std::filesystem;

// Faster than the camera, so that the test is short; frames may be dropped.
constexpr double kFast = 4.0, kTwice = 2.0, kCameraSpeed = 1.0;

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

// Of the threads that must not call the heap, while it was watched.
void expect_no_heap_calls_so_far() {
  std::uint64_t calls = 0;
  for (const char* name : {Pipeline::kCaptureThread, Pipeline::kTrackingThread, Pipeline::kOutputThread}) {
    EXPECT_EQ(test::heap_calls(name), 0U) << name;
    calls += test::heap_calls(name);
  }
  if (calls > 0) test::print_heap_calls();
  // The watch works: mapping does allocate.
  EXPECT_GT(test::heap_calls(Pipeline::kMappingThread), 0U);
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
  expect_no_heap_calls_so_far();
}

TEST(RecordedThreads, NoHeapOnKittiAfterSettling) {
  expect_no_heap_calls("kitti {}/kitti 03", kCameraSpeed);
}

TEST(RecordedThreads, NoHeapOnEurocAfterSettling) {
  expect_no_heap_calls("euroc {}/euroc/MH_01_part", kFast);
}

// What a recording shows instead of its images.
enum class Disturbance : std::uint8_t { kNone, kBlack, kMirrored };

// The recording is shown three times. At first with three dark stretches, which end in the same map; then
// mirrored; then as it is. Both changes end in a new map. Descriptors would find an image that is upside
// down.
constexpr int kPasses = 3;

Disturbance disturbance_at(int pass, double time_s) {
  if (pass > 0) return pass == 1 ? Disturbance::kMirrored : Disturbance::kNone;
  for (const double dark_s : {4.0, 8.0, 12.0})
    if (time_s >= dark_s && time_s < dark_s + 0.6) return Disturbance::kBlack;
  return Disturbance::kNone;
}

void disturb(image_t* image, Disturbance disturbance) {
  ipc::ImageDecoder decoder;
  ipc::GreyImage grey;
  ASSERT_EQ(decoder.decode(*image, &grey), ipc::ImageStatus::kOk);
  for (auto row = grey.pixels.begin(); row != grey.pixels.end(); row += grey.width_px) {
    if (disturbance == Disturbance::kBlack)
      std::fill(row, row + grey.width_px, std::uint8_t{0});
    else
      std::reverse(row, row + grey.width_px);
  }
  image->pixel_format = image_t::PIXEL_FORMAT_GREY;
  image->row_stride = 0;
  image->data.assign(grey.pixels.begin(), grey.pixels.end());
  image->size = static_cast<std::int32_t>(image->data.size());
}

// The images of one pass, and the other messages of the first.
void write_pass(const std::string& from, int pass, std::int64_t* end_utime, ipc::LogWriter* writer) {
  ipc::LogReader reader(from);
  ipc::LogEvent event;
  std::optional<std::int64_t> first_utime;
  std::int64_t shift_us = 0;
  while (reader.next(&event)) {
    if (event.channel != "CAMERA_0") {
      if (pass == 0 && event.channel != "CAMERA_1")
        writer->write(event.channel, event.timestamp_us, event.data);
      continue;
    }
    image_t image;
    ASSERT_TRUE(ipc::decode(event.data, &image));
    if (!first_utime) {
      first_utime = image.utime;
      if (pass > 0) shift_us = *end_utime + 50'000 - image.utime;
    }
    const auto disturbance = disturbance_at(pass, 1e-6 * static_cast<double>(image.utime - *first_utime));
    if (disturbance != Disturbance::kNone) disturb(&image, disturbance);
    image.utime += shift_us;
    *end_utime = image.utime;
    writer->write_message(event.channel, event.timestamp_us + shift_us, image);
  }
}

void write_disturbed(const std::string& from, const std::string& to) {
  ipc::LogWriter writer(to);
  std::int64_t end_utime = 0;
  for (int pass = 0; pass < kPasses; ++pass)
    ASSERT_NO_FATAL_FAILURE(write_pass(from, pass, &end_utime, &writer));
  writer.close();
}

// Relocalisation and the search for a first map included, from the decoder's first images on.
TEST(RecordedThreads, NoHeapOverFiveLossesAndTwoNewMaps) {
  if (!fs::exists(test::kData)) GTEST_SKIP() << "no recordings in " << test::kData;
  if (!test::counts_allocations()) GTEST_SKIP() << "a sanitizer owns the heap";
  constexpr int kDecodersFirstImages = 5;
  const test::Scratch scratch;
  const std::string log = scratch.path("run.lcm"), disturbed = scratch.path("disturbed.lcm");
  ASSERT_TRUE(test::import_recording("euroc {}/euroc/MH_01_part", log));
  ASSERT_NO_FATAL_FAILURE(write_disturbed(log, disturbed));
  int frames = 0, losses = 0;
  std::int32_t map_id = 0;
  bool was_tracked = false;
  ThreadHooks hooks;
  hooks.on_output = [&](const FrameOutput& frame) {
    if (++frames == kDecodersFirstImages) test::watch_heap();
    const bool is_tracked = frame.result.has_pose;
    losses += was_tracked && !is_tracked ? 1 : 0;
    was_tracked = is_tracked;
    map_id = std::max(map_id, frame.result.map_id);
  };
  EXPECT_EQ(replay(threaded(scratch, disturbed, kTwice), quiet_config(), hooks), 0);
  test::stop_watching_heap();
  expect_no_heap_calls_so_far();
  EXPECT_GE(losses, 5);
  EXPECT_GE(map_id, 3);
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
