// SPDX-License-Identifier: Apache-2.0
// The live daemon with a camera of film: what it does with a camera that comes, goes and hangs, what it tells
// the service manager, and that what it recorded replays to the same bytes.
#include "daemon/live.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <thread>

#include "daemon/replay.h"
#include "ipc/channels.h"
#include "ipc/log.h"
#include "tests/daemon/can_story.h"
#include "tests/daemon/live_fixture.h"
#include "tests/daemon/system/notify_socket.h"
#include "tests/ipc/log_events.h"

namespace farpoint::daemon {
namespace {

using Live = LiveRunTest;

TEST_F(Live, StopsInOrderWithinASecond) {
  EXPECT_EQ(run([this] { return frames_ >= 10; }), 0);
  EXPECT_LT(stop_took_s_, 1.0);
  EXPECT_NE(printed_.find("farpointd: done"), std::string::npos) << printed_;
  // Ages are from mid-exposure by the same clock.
  EXPECT_GT(last_seen_.age_us, 0);
  EXPECT_LT(last_seen_.age_us, 1'000'000);
}

TEST_F(Live, FramesPastTheirDeadlineAreMarkedAndCounted) {
  options_.output = scratch_.path("out.lcm");
  config_.realtime.deadline_ms = 0.001;  // too short for any frame
  config_.lcm.status_rate_hz = 100;      // with every frame
  ASSERT_EQ(run([this] { return frames_ >= 10; }), 0);
  const auto timing = test::messages_of<timing_t>(options_.output, ipc::kTimingChannel);
  ASSERT_GE(timing.size(), 10U);
  for (const timing_t& m : timing) {
    EXPECT_EQ(m.deadline_ms, 0.001);
    EXPECT_TRUE(m.deadline_missed);
  }
  const auto status = test::messages_of<status_t>(options_.output, ipc::kStatusChannel);
  ASSERT_GE(status.size(), 10U);
  EXPECT_EQ(status.back().deadlines_missed, status.back().frames_tracked);
}

TEST_F(Live, WithoutAnotherLimitTheDeadlineIsAFramePeriod) {
  options_.output = scratch_.path("out.lcm");
  config_.camera.rate_hz = 0.1;  // that anybody keeps
  config_.lcm.status_rate_hz = 100;
  ASSERT_EQ(run([this] { return frames_ >= 10; }), 0);
  const auto timing = test::messages_of<timing_t>(options_.output, ipc::kTimingChannel);
  ASSERT_GE(timing.size(), 10U);
  EXPECT_EQ(timing.back().deadline_ms, 10'000.0);
  for (const timing_t& m : timing) EXPECT_FALSE(m.deadline_missed);
  const auto status = test::messages_of<status_t>(options_.output, ipc::kStatusChannel);
  ASSERT_FALSE(status.empty());
  EXPECT_EQ(status.back().deadlines_missed, 0);
}

TEST_F(Live, WhatWasRecordedReplaysToTheSamePoses) {
  options_.record = scratch_.path("run.lcm");
  options_.output = scratch_.path("out.lcm");
  options_.live_trajectory = scratch_.path("live.tum");
  config_.lcm.status_rate_hz = 0.1;
  ASSERT_EQ(run([this] { return frames_ >= 45; }), 0);
  ASSERT_TRUE(silent_.empty());
  Options again;
  again.replay = options_.record;
  again.schedule_log = options_.output;
  again.output = scratch_.path("again.lcm");
  again.live_trajectory = scratch_.path("again.tum");
  testing::internal::CaptureStdout();
  ASSERT_EQ(replay(again, config_), 0);
  testing::internal::GetCapturedStdout();
  const auto poses = test::read_bytes(options_.live_trajectory);
  EXPECT_GT(poses.size(), 500U);  // it did track
  EXPECT_TRUE(poses == test::read_bytes(again.live_trajectory));
  // Pose messages hold no measured time but the age, which the schedule carries.
  const auto before = test::events_of(options_.output), after = test::events_of(again.output);
  int poses_compared = 0;
  for (std::size_t i = 0; i < std::min(before.size(), after.size()); ++i) {
    if (!before[i].starts_with(ipc::kOdometryChannel)) continue;
    ASSERT_TRUE(before[i] == after[i]) << i;
    ++poses_compared;
  }
  EXPECT_GT(poses_compared, 40);
}

TEST_F(Live, ACameraThatIsAwayIsPublishedAtOnceAndAtTheStatusRate) {
  camera_->leave(0.8, 2.2);
  options_.can_log = scratch_.path("out.candump");
  EXPECT_EQ(run([this] { return frames_ >= 35; }), 0);
  ASSERT_GE(silent_.size(), 5U);  // 1.4 s at 5 Hz
  ASSERT_LE(silent_.size(), 10U);
  for (const FrameOutput& f : silent_) {
    EXPECT_FALSE(f.valid);
    EXPECT_FALSE(f.result.has_pose);
    EXPECT_EQ(f.result.quality, -1);
  }
  // Told as soon as the driver knew, not after the time-out.
  const double first_s = 1e-6 * static_cast<double>(silent_[0].result.utime);
  const double second_s = 1e-6 * static_cast<double>(silent_[1].result.utime);
  EXPECT_NEAR(second_s - first_s, 0.2, 0.1);
  // And it went on with the images.
  EXPECT_GT(last_seen_.result.utime, silent_.back().result.utime);
}

TEST_F(Live, StampsOfNoClockAreCountedInTheStatusAndSaidInTheLogNowAndThen) {
  camera_->lose_stamps();
  options_.output = scratch_.path("out.lcm");
  config_.lcm.status_rate_hz = 100;
  ASSERT_EQ(run([this] { return frames_ >= 45; }), 0);
  const auto status = test::messages_of<status_t>(options_.output, ipc::kStatusChannel);
  ASSERT_FALSE(status.empty());
  EXPECT_GE(status.back().times_unknown, 45);
  const std::string camera = "camera /dev/video0: ";
  const std::size_t first = said_.find(camera);
  ASSERT_NE(first, std::string::npos) << said_;
  EXPECT_NE(said_.find("images with a time stamp of no clock", first), std::string::npos) << said_;
  EXPECT_EQ(said_.find(camera, first + 1), std::string::npos) << said_;  // 2 s: once
}

TEST_F(Live, WithoutACameraItIsReadyAliveAndSaysSo) {
  test::NotifySocket manager(scratch_.path("notify"), 400'000);
  camera_->leave(0.0, 1e9);
  const double began_s = steady_s();
  hooks_.on_watch = [&] { manager.read_all(); };
  EXPECT_EQ(run([&] { return steady_s() - began_s > 2.0; }), 0);
  manager.read_all();
  EXPECT_EQ(frames_, 0);
  EXPECT_GE(silent_.size(), 7U);
  EXPECT_EQ(manager.count("READY=1"), 1);
  EXPECT_EQ(manager.count("STOPPING=1"), 1);
  EXPECT_GE(manager.count("STATUS=no_camera"), 1);
  EXPECT_GE(manager.count("WATCHDOG=1"), 5);
}

TEST_F(Live, ACameraThatTakesLongToOpenIsNoHang) {
  test::NotifySocket manager(scratch_.path("notify"), 400'000);
  camera_->open_slowly(2.5);
  const double began_s = steady_s();
  hooks_.on_watch = [&] { manager.read_all(); };
  EXPECT_EQ(run([this] { return frames_ >= 10; }), 0);
  manager.read_all();
  int meanwhile = 0;
  for (const auto& [time_s, text] : manager.messages)
    meanwhile += text.starts_with("WATCHDOG=1") && time_s > began_s + 0.5 && time_s < began_s + 2.4 ? 1 : 0;
  EXPECT_GE(meanwhile, 10);
  EXPECT_GE(silent_.size(), 5U);  // meanwhile: no camera
  EXPECT_NE(said_.find("camera /dev/video0: opening or closing it has taken"), std::string::npos) << said_;
}

TEST_F(Live, ACameraThatOpensForLongerThanItsLimitIsAHang) {
  test::NotifySocket manager(scratch_.path("notify"), 400'000);
  config_.camera.open_limit_s = 1.0;
  camera_->open_slowly(4.0);
  const double began_s = steady_s();
  hooks_.on_watch = [&] { manager.read_all(); };
  EXPECT_EQ(run([this] { return frames_ >= 10; }), 0);
  int meanwhile = 0, after = 0;
  for (const auto& [time_s, text] : manager.messages) {
    if (!text.starts_with("WATCHDOG=1")) continue;
    // It opens from the start of the run on, up to 1 s after began_s. Its limit and that of capture make 1.5
    // s.
    if (time_s > began_s + 4.1)
      ++after;
    else if (time_s > began_s + 2.6 && time_s < began_s + 3.9)
      ++meanwhile;
  }
  EXPECT_EQ(meanwhile, 0);
  EXPECT_GE(after, 1);
}

TEST_F(Live, TheBusTellsTheTruthFromStartToStopWhileTrackingHangs) {
  options_.can_log = scratch_.path("out.candump");
  std::atomic<double> hung_from_s{0.0}, hung_to_s{0.0};
  std::atomic<int> tracked{0};
  hooks_.on_tracked = [&](const slam::FrameResult&) {
    if (++tracked != 30) return;
    hung_from_s = steady_s();
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    hung_to_s = steady_s();
  };
  EXPECT_EQ(run([this] { return frames_ >= 45; }), 0);
  const auto said = test::read_can_story(options_.can_log);
  ASSERT_GT(said.size(), 100U);
  EXPECT_EQ(said.front().state, int{status_t::STATE_STARTING});
  EXPECT_EQ(said.back().state, int{status_t::STATE_STOPPED});
  EXPECT_EQ(said.back().valid, 0.0);
  int meanwhile = 0, valid_before = 0;
  double longest_s = 0.0;
  for (std::size_t i = 0; i + 1 < said.size(); ++i) {
    const test::CanEpoch& s = said[i];
    EXPECT_EQ(s.boot, said.front().boot);
    EXPECT_NE(s.boot, 0.0);
    if (i > 0) longest_s = std::max(longest_s, s.time_s - said[i - 1].time_s);
    if (s.valid != 0.0) {
      EXPECT_LE(s.age_s, 0.2501);
    }
    valid_before += s.time_s < hung_from_s && s.valid != 0.0;
    if (s.time_s < hung_from_s + 0.26 || s.time_s > hung_to_s) continue;
    ++meanwhile;
    EXPECT_EQ(s.valid, 0.0);
    EXPECT_EQ(s.state, int{status_t::STATE_LOST});
  }
  EXPECT_GE(valid_before, 5);
  EXPECT_GE(meanwhile, 40);
  EXPECT_LT(longest_s, 0.5);  // a shared machine; 20 ms where it is free
}

TEST_F(Live, HangupTakesOverWhatMayChange) {
  test::NotifySocket manager(scratch_.path("notify"), 400'000);
  reloaded_ = config_;
  reloaded_.camera.exposure.target_grey = 77.0;
  reloaded_.lcm.status_rate_hz = 2.0;
  reloaded_.can.interface = "can9";  // may not
  const auto target_grey = camera_->target_grey();
  bool sent = false;
  hooks_.on_watch = [&] {
    manager.read_all();
    if (sent || frames_ < 5) return;
    sent = true;
    raise(SIGHUP);
  };
  EXPECT_EQ(run([this] { return frames_ >= 15; }), 0);
  EXPECT_EQ(target_grey->load(), 77.0);
  EXPECT_EQ(manager.count("RELOADING=1"), 1);
  EXPECT_EQ(manager.count("READY=1"), 2);
  EXPECT_EQ(keys_that_need_a_restart(config_, reloaded_), "can.interface");
  EXPECT_EQ(keys_that_need_a_restart(config_, config_), "");
}

TEST_F(Live, WhatIsMissingIsSaidBeforeItStarts) {
  config_.camera.calibration = "/nonexistent/camera.yaml";
  EXPECT_NE(complaint().find("/nonexistent/camera.yaml: cannot be opened"), std::string::npos) << complaint();
  config_.camera.calibration = scratch_.path("camera.yaml");
  config_.camera.device = "video0";
  EXPECT_NE(complaint().find("camera.device: 'video0' names no camera, expected a path like /dev/video0"),
            std::string::npos)
      << complaint();
  config_.camera.driver = CameraDriverChoice::kLibcamera;
  config_.camera.device = "/dev/video0";
#if FARPOINT_TEST_WITH_LIBCAMERA
  EXPECT_NE(complaint().find("camera.device: '/dev/video0' names no camera of libcamera's, expected its id"),
            std::string::npos)
      << complaint();
#else
  EXPECT_NE(complaint().find("camera.driver: libcamera: this farpointd was built without it"),
            std::string::npos)
      << complaint();
#endif
}

}  // namespace
}  // namespace farpoint::daemon
