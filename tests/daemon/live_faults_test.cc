// SPDX-License-Identifier: Apache-2.0
// The live daemon while one of its threads hangs, or a side function cannot begin.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "ipc/candump.h"
#include "ipc/channels.h"
#include "tests/daemon/can_story.h"
#include "tests/daemon/live_fixture.h"
#include "tests/daemon/system/notify_socket.h"
#include "tests/ipc/log_events.h"

namespace farpoint::daemon {
namespace {

namespace fs = std::filesystem;

// --- one thread hangs

constexpr double kLimit_s = 0.3, kHeld_s = 2.5;
// What the test's own thread may be late by.
constexpr double kSlack_s = 0.7;

class HeldLiveTest : public LiveRunTest {
 protected:
  HeldLiveTest() {
    config_.watchdog = {kLimit_s, kLimit_s, kLimit_s, kLimit_s};
    options_.can_log = scratch_.path("out.candump");
  }
  // At the hook of one thread: the call with this number is held.
  void hold(int number) {
    if (++calls_ != number) return;
    held_from_s_ = steady_s();
    std::this_thread::sleep_for(std::chrono::duration<double>(kHeld_s));
    held_to_s_ = steady_s();
  }
  // Until a second after the hold. Feeds of the watchdog before, during (once the limit has passed) and
  // after.
  void run_and_count_feeds() {
    test::NotifySocket manager(scratch_.path("notify"), 400'000);
    hooks_.on_watch = [&] { manager.read_all(); };
    EXPECT_EQ(run([this] { return held_to_s_ > 0.0 && steady_s() > held_to_s_ + 1.0; }), 0);
    for (const auto& [time_s, text] : manager.messages) {
      if (!text.starts_with("WATCHDOG=1")) continue;
      if (time_s < held_from_s_)
        ++fed_before_;
      else if (time_s > held_from_s_ + kLimit_s + kSlack_s && time_s < held_to_s_)
        ++fed_meanwhile_;
      else if (time_s > held_to_s_)
        ++fed_after_;
    }
  }
  void expect_hang_was_found() const {
    EXPECT_GE(fed_before_, 1);
    EXPECT_EQ(fed_meanwhile_, 0);
    EXPECT_GE(fed_after_, 1);
  }
  // Epochs on the bus from `later_s` after the hold began to its end.
  [[nodiscard]] std::vector<test::CanEpoch> epochs_while_held(double later_s) const {
    std::vector<test::CanEpoch> held;
    for (const test::CanEpoch& epoch : test::read_can_story(options_.can_log))
      if (epoch.time_s > held_from_s_ + later_s && epoch.time_s < held_to_s_) held.push_back(epoch);
    return held;
  }

  std::atomic<int> calls_{0};
  std::atomic<double> held_from_s_{0.0}, held_to_s_{0.0};
  int fed_before_ = 0, fed_meanwhile_ = 0, fed_after_ = 0;
};

TEST_F(HeldLiveTest, AHungCaptureStopsTheFeedingAndTheBusSaysThatThereIsNoCamera) {
  hooks_.on_captured = [this] { hold(30); };
  run_and_count_feeds();
  expect_hang_was_found();
  const auto epochs = epochs_while_held(0.6);
  EXPECT_GE(epochs.size(), 20U);
  for (const test::CanEpoch& epoch : epochs) {
    EXPECT_EQ(epoch.valid, 0.0);
    EXPECT_EQ(epoch.state, int{status_t::STATE_NO_CAMERA});
  }
}

TEST_F(HeldLiveTest, AHungTrackerStopsTheFeedingAndTheBusSaysThatThereIsNoPose) {
  hooks_.on_tracked = [this](const slam::FrameResult&) { hold(30); };
  run_and_count_feeds();
  expect_hang_was_found();
  const auto epochs = epochs_while_held(0.3);
  EXPECT_GE(epochs.size(), 20U);
  for (const test::CanEpoch& epoch : epochs) EXPECT_EQ(epoch.valid, 0.0);
}

TEST_F(HeldLiveTest, AHungMappingStopsTheFeedingAndTheBusGoesOnWithTheTruth) {
  hooks_.on_mapped = [this] { hold(4); };
  run_and_count_feeds();
  expect_hang_was_found();
  const auto epochs = epochs_while_held(0.0);
  EXPECT_GE(epochs.size(), 20U);
  for (const test::CanEpoch& epoch : epochs) {
    if (epoch.valid != 0.0) {
      EXPECT_LE(epoch.age_s, 0.2501);
    }
  }
}

TEST_F(HeldLiveTest, AHungOutputStopsTheFeedingAndTheBusIsSilent) {
  const auto count_frame = hooks_.on_output;
  hooks_.on_output = [this, count_frame](const FrameOutput& f) {
    count_frame(f);
    hold(30);
  };
  run_and_count_feeds();
  expect_hang_was_found();
  EXPECT_TRUE(epochs_while_held(0.0).empty());
  for (const test::CanEpoch& epoch : test::read_can_story(options_.can_log)) {
    if (epoch.valid != 0.0) {
      EXPECT_LE(epoch.age_s, 0.2501);
    }
  }
}

// --- a side function cannot begin

class SideLiveTest : public LiveRunTest {
 protected:
  [[nodiscard]] std::vector<status_t> statuses() const {
    return test::messages_of<status_t>(options_.output, ipc::kStatusChannel);
  }
  static bool misses(const status_t& status, SideFunction which) {
    return (status.side_missing >> static_cast<int>(which) & 1) != 0;
  }
};

TEST_F(SideLiveTest, ARecordingThatCannotBeginIsReportedAndBeginsOnceItCan) {
  options_.record = scratch_.path("later/run.lcm");
  options_.output = scratch_.path("out.lcm");
  config_.lcm.status_rate_hz = 100;
  std::atomic<int> frames_without{0};
  const auto count_frame = hooks_.on_output;
  hooks_.on_output = [&, count_frame](const FrameOutput& f) {
    count_frame(f);
    if (frames_ == 30) {
      frames_without = 30;
      fs::create_directory(scratch_.path("later"));
    }
  };
  const double began_s = steady_s();
  EXPECT_EQ(run([&] { return frames_ >= 100 || steady_s() - began_s > 60.0; }), 0);
  EXPECT_EQ(frames_without, 30);
  const auto all = statuses();
  ASSERT_GE(all.size(), 50U);
  EXPECT_TRUE(misses(all[10], SideFunction::kRecording));
  EXPECT_GE(all.back().side_failures, 1);
  EXPECT_EQ(all.back().side_missing, 0);
  EXPECT_GE(test::messages_of<image_t>(options_.record, "CAMERA_0").size(), 5U);
  EXPECT_NE(printed_.find("later/run.lcm"), std::string::npos) << printed_;
}

TEST_F(SideLiveTest, NoFileOfARunThatCannotBeWrittenStopsTracking) {
  options_.record = scratch_.path("no/run.lcm");
  options_.output = scratch_.path("no/out.lcm");
  options_.live_trajectory = scratch_.path("no/live.tum");
  options_.can_log = scratch_.path("no/out.candump");
  config_.log.file = scratch_.path("no/farpointd.log");
  EXPECT_EQ(run([this] { return frames_ >= 10; }), 0);
  EXPECT_GE(frames_, 10);
  EXPECT_NE(printed_.find("farpointd: done"), std::string::npos) << printed_;
  EXPECT_EQ(printed_.find("wrote"), std::string::npos) << printed_;
}

// A provider whose file cannot be opened stands in for a network without a multicast route.
TEST_F(SideLiveTest, WithoutItsNetworkItTracksAndOpensLcmOnceItCan) {
  config_.lcm.enabled = true;
  config_.lcm.url = "file://" + scratch_.path("later") + "/network.lcm?mode=w";
  options_.output = scratch_.path("out.lcm");
  config_.lcm.status_rate_hz = 100;
  const auto count_frame = hooks_.on_output;
  hooks_.on_output = [&, count_frame](const FrameOutput& f) {
    count_frame(f);
    if (frames_ == 30) fs::create_directory(scratch_.path("later"));
  };
  const double began_s = steady_s();
  EXPECT_EQ(run([&] { return frames_ >= 100 || steady_s() - began_s > 60.0; }), 0);
  const auto all = statuses();
  ASSERT_GE(all.size(), 50U);
  EXPECT_TRUE(misses(all[10], SideFunction::kLcm));
  EXPECT_GT(all[10].lcm_send_errors, 0);
  EXPECT_FALSE(misses(all.back(), SideFunction::kLcm));
  EXPECT_GE(test::messages_of<odometry_t>(scratch_.path("later/network.lcm"), ipc::kOdometryChannel).size(),
            5U);
}

TEST_F(SideLiveTest, AnLcmUrlThatCanNeverWorkStopsTheStart) {
  config_.lcm.enabled = true;
  for (const char* url :
       {"udp://239.255.76.67:7667", "udpm://farpoint.local:7667", "udpm://239.255.76.67:seven"}) {
    config_.lcm.url = url;
    EXPECT_NE(complaint().find(std::string("configuration: lcm.url: '") + url + "', expected"),
              std::string::npos)
        << complaint();
  }
}

// A pipe that is full and has no reader stands in for a disk that does not answer.
TEST_F(SideLiveTest, ADiskThatDoesNotAnswerHoldsNeitherTrackingNorTheBus) {
  options_.output = scratch_.path("disk");
  options_.can_log = scratch_.path("out.candump");
  ASSERT_EQ(mkfifo(options_.output.c_str(), 0600), 0);
  const int disk = open(options_.output.c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(disk, 0);
  ASSERT_GT(fcntl(disk, F_SETPIPE_SZ, 4096), 0);
  std::thread answer;
  const double began_s = steady_s();
  const int status = run([&] {
    if (frames_ < 60 && steady_s() - began_s < 60.0) return false;
    // The end of the run needs the disk.
    answer = std::thread([disk] {
      ASSERT_EQ(fcntl(disk, F_SETFL, 0), 0);
      char bytes[4096];
      while (read(disk, bytes, sizeof bytes) > 0) continue;
    });
    return true;
  });
  answer.join();
  close(disk);
  EXPECT_EQ(status, 0);
  EXPECT_GE(frames_, 60) << "after a minute";
  const auto story = test::read_can_story(options_.can_log);
  ASSERT_GT(story.size(), 100U);
  double longest_s = 0.0;
  for (std::size_t i = 1; i + 1 < story.size(); ++i)
    longest_s = std::max(longest_s, story[i].time_s - story[i - 1].time_s);
  EXPECT_LT(longest_s, 0.5);  // a shared machine; 20 ms where it is free
}

TEST_F(SideLiveTest, ARequiredCoreThatIsRefusedEndsTheProcess) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        alarm(60);  // it would hang
        config_.realtime.require = true;
        config_.realtime.tracking.core = 1000;
        options_.record = scratch_.path("run.lcm");
        LiveEnvironment environment;
        environment.camera = std::move(camera_);
        try {
          (void)live(options_, config_, {}, std::move(environment));
        } catch (const std::runtime_error& error) {
          std::fprintf(stderr, "%s\n", error.what());
          std::exit(1);
        }
        std::exit(0);
      },
      testing::ExitedWithCode(1), "is not on core 1000.*realtime.require is set");
}

// --- what the last line tells

TEST_F(LiveRunTest, TheLastLineTellsWhenItInitialisedAndHowManyMapsThereWere) {
  EXPECT_EQ(run([this] { return last_seen_state_ == slam::State::kTracking; }), 0);
  EXPECT_EQ(printed_.find("never initialised"), std::string::npos) << printed_;
  EXPECT_NE(printed_.find("initialised after "), std::string::npos) << printed_;
  EXPECT_NE(printed_.find(", 1 map,"), std::string::npos) << printed_;
}

TEST_F(LiveRunTest, TheLastLineOfARunWithoutImagesIsThatItNeverInitialised) {
  camera_->leave(0.0, 1e9);
  const double began_s = steady_s();
  EXPECT_EQ(run([&] { return steady_s() - began_s > 0.3; }), 0);
  EXPECT_NE(printed_.find("never initialised: 0 frames"), std::string::npos) << printed_;
  EXPECT_NE(printed_.find(", 0 maps,"), std::string::npos) << printed_;
}

}  // namespace
}  // namespace farpoint::daemon
