// The live daemon with a camera of film: what it does with a camera that comes, goes and hangs, what it tells
// the service manager, and that what it recorded replays to the same bytes.
#include "daemon/live.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <thread>

#include "daemon/replay.h"
#include "daemon/stage_clock.h"
#include "ipc/candump.h"
#include "ipc/channels.h"
#include "ipc/log.h"
#include "tests/daemon/notify_socket.h"
#include "tests/daemon/synthetic_log.h"
#include "tests/ipc/log_events.h"
#include "tests/ipc/scratch.h"

namespace farpoint::daemon {
namespace {

constexpr double kRate_hz = 20.0;
constexpr int kFrames = 50;

// Shows synthetic images at their rate, and is away from `away_from_s` to `away_to_s` after its first image.
class FilmCamera final : public drivers::Camera {
 public:
  FilmCamera() {
    test::SyntheticLog log;
    for (int i = 0; i < kFrames; ++i) images_.push_back(test::synthetic_image(log, i));
  }
  void leave(double from_s, double to_s) {
    away_from_s_ = from_s;
    away_to_s_ = to_s;
  }

  bool next(int timeout_ms, ipc::GreyImage* image, drivers::CameraFrame* frame) override {
    const double now_s = steady_s();
    if (began_s_ < 0.0) began_s_ = now_s;
    streaming_ = now_s - began_s_ < away_from_s_ || now_s - began_s_ >= away_to_s_;
    const double due_s = began_s_ + static_cast<double>(shown_) / kRate_hz;
    const double wait_s = streaming_ ? due_s - now_s : 1e-3 * timeout_ms;
    std::this_thread::sleep_for(std::chrono::duration<double>(std::clamp(wait_s, 0.0, 1e-3 * timeout_ms)));
    if (!streaming_ || wait_s > 1e-3 * timeout_ms) return false;
    const image_t& shown = images_[static_cast<std::size_t>(shown_) % images_.size()];
    *image = {shown.width, shown.height, shown.data};
    frame->utime = std::llround(1e6 * steady_s());
    frame->sequence = shown_++;
    ++counts_.frames;
    return true;
  }
  [[nodiscard]] bool is_streaming() const override { return streaming_; }
  [[nodiscard]] const drivers::CameraCounts& counts() const override { return counts_; }
  void on_event(std::function<void(const drivers::CameraEvent&)>) override {}
  void set_exposure(const drivers::ExposureOptions& options) override { target_grey = options.target_grey; }

  static inline std::atomic<double> target_grey{0.0};

 private:
  std::vector<image_t> images_;
  double began_s_ = -1.0, away_from_s_ = 1e9, away_to_s_ = 1e9;
  int shown_ = 0;
  std::atomic<bool> streaming_{true};
  drivers::CameraCounts counts_;
};

class Live : public testing::Test {
 protected:
  Live() {
    std::ofstream(scratch_.path("camera.yaml")) << "model: pinhole-radtan\nwidth_px: 480\nheight_px: "
                                                   "320\nfx_px: 400\nfy_px: 400\ncx_px: 240\ncy_px: 160\n"
                                                   "distortion: []\nrate_hz: 20\n";
    config_.camera.calibration = scratch_.path("camera.yaml");
    config_.camera.rate_hz = kRate_hz;
    config_.lcm.enabled = false;
    config_.realtime.lock_memory = false;
    config_.log.level = "warning";
    hooks_.on_output = [this](const FrameOutput& f) {
      if (f.result.state == slam::State::kNoCamera) {
        silent_.push_back(f);
      } else {
        last_seen_ = f;
        ++frames_;
      }
    };
  }

  // Runs until `enough` says so, then as SIGTERM ends it.
  int run(const std::function<bool()>& enough) {
    LiveEnvironment environment;
    environment.camera = std::move(camera_);
    const auto on_watch = hooks_.on_watch;
    hooks_.on_watch = [&, on_watch] {
      if (on_watch) on_watch();
      if (stopped_s_ == 0.0 && enough()) {
        stopped_s_ = steady_s();
        raise(SIGTERM);
      }
    };
    environment.hooks = hooks_;
    testing::internal::CaptureStdout();
    const int status = live(
        options_, config_, [this] { return reloaded_; }, std::move(environment));
    stop_took_s_ = steady_s() - stopped_s_;
    printed_ = testing::internal::GetCapturedStdout();
    return status;
  }

  const test::Scratch scratch_;
  Options options_;
  Config config_, reloaded_;
  ThreadHooks hooks_;
  std::unique_ptr<FilmCamera> camera_ = std::make_unique<FilmCamera>();
  std::atomic<int> frames_{0};
  FrameOutput last_seen_;            // output's thread, read after the run
  std::vector<FrameOutput> silent_;  // the same
  double stopped_s_ = 0, stop_took_s_ = 0;
  std::string printed_;
};

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
  config_.realtime.deadline_ms = 0.001;  // nobody keeps that
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

TEST_F(Live, AHungTrackerIsNotCalledAlive) {
  test::NotifySocket manager(scratch_.path("notify"), 400'000);
  std::atomic<double> hung_from_s{0.0}, hung_to_s{0.0};
  std::atomic<int> tracked{0};
  hooks_.on_tracked = [&](const slam::FrameResult&) {
    if (++tracked != 15) return;
    hung_from_s = steady_s();
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    hung_to_s = steady_s();
  };
  hooks_.on_watch = [&] { manager.read_all(); };
  EXPECT_EQ(run([this] { return frames_ >= 30; }), 0);
  ASSERT_GT(hung_to_s.load(), 0.0);
  int before = 0, meanwhile = 0, after = 0;
  for (const auto& [time_s, text] : manager.messages) {
    if (!text.starts_with("WATCHDOG=1")) continue;
    // The first look may still see the frame before.
    if (time_s < hung_from_s + 0.1)
      ++before;
    else if (time_s < hung_to_s)
      ++meanwhile;
    else
      ++after;
  }
  EXPECT_GE(before, 2);
  EXPECT_EQ(meanwhile, 0);
  EXPECT_GE(after, 1);
}

TEST_F(Live, HangupTakesOverWhatMayChange) {
  test::NotifySocket manager(scratch_.path("notify"), 400'000);
  reloaded_ = config_;
  reloaded_.camera.exposure.target_grey = 77.0;
  reloaded_.lcm.status_rate_hz = 2.0;
  reloaded_.can.interface = "can9";  // may not
  FilmCamera::target_grey = 0.0;
  bool sent = false;
  hooks_.on_watch = [&] {
    manager.read_all();
    if (sent || frames_ < 5) return;
    sent = true;
    raise(SIGHUP);
  };
  EXPECT_EQ(run([this] { return frames_ >= 15; }), 0);
  EXPECT_EQ(FilmCamera::target_grey.load(), 77.0);
  EXPECT_EQ(manager.count("RELOADING=1"), 1);
  EXPECT_EQ(manager.count("READY=1"), 2);
  EXPECT_EQ(keys_that_need_a_restart(config_, reloaded_), "can.interface");
  EXPECT_EQ(keys_that_need_a_restart(config_, config_), "");
}

TEST_F(Live, WhatIsMissingIsSaidBeforeItStarts) {
  const auto complaint = [&] {
    try {
      (void)live(options_, config_, {}, {});
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
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
