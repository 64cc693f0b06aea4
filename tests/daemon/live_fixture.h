// SPDX-License-Identifier: Apache-2.0
// A live run in a test: cameras of film, a configuration for them, and what was published.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "daemon/live.h"
#include "daemon/system/stage_clock.h"
#include "tests/daemon/synthetic_log.h"
#include "tests/ipc/scratch.h"

namespace farpoint::daemon {

inline constexpr double kFilmRate_hz = 20.0;
inline constexpr int kFilmFrames = 50;

// Shows synthetic images at their rate, and is away from `away_from_s` to `away_to_s` after its first image.
class FilmCamera final : public drivers::Camera {
 public:
  FilmCamera() {
    test::SyntheticLog log;
    for (int i = 0; i < kFilmFrames; ++i) images_.push_back(test::synthetic_image(log, i));
  }
  void leave(double from_s, double to_s) {
    away_from_s_ = from_s;
    away_to_s_ = to_s;
  }
  // Each of its images has a stamp of no clock, as its driver counts it.
  void lose_stamps() { loses_stamps_ = true; }
  // Its first opening takes this long.
  void open_slowly(double takes_s) { opening_takes_s_ = takes_s; }
  // One shutter for both: image n of the other is taken `later_us` after image n of this one. Images due
  // while a camera is away never come.
  void share_shutter_with(FilmCamera* other, std::int64_t later_us) {
    other->shutter_ = shutter_ = std::make_shared<std::atomic<double>>(-1.0);
    other->later_us_ = later_us;
  }

  bool next(int timeout_ms, ipc::GreyImage* image, drivers::CameraFrame* frame) override {
    const double now_s = steady_s();
    if (opening_takes_s_ > 0.0) return open(now_s);
    begin(now_s);
    streaming_ = now_s - began_s_ < away_from_s_ || now_s - began_s_ >= away_to_s_;
    if (shutter_ && !streaming_) miss_until(now_s);
    const double due_s = began_s_ + static_cast<double>(shown_) / kFilmRate_hz;
    const double wait_s = streaming_ ? due_s - now_s : 1e-3 * timeout_ms;
    std::this_thread::sleep_for(std::chrono::duration<double>(std::clamp(wait_s, 0.0, 1e-3 * timeout_ms)));
    if (!streaming_ || wait_s > 1e-3 * timeout_ms) return false;
    const image_t& shown = images_[static_cast<std::size_t>(shown_) % images_.size()];
    *image = {shown.width, shown.height, shown.data};
    frame->utime = std::llround(1e6 * (shutter_ ? due_s : steady_s())) + later_us_;
    frame->sequence = shown_++;
    ++counts_.frames;
    if (loses_stamps_) ++counts_.times_unknown;
    return true;
  }
  [[nodiscard]] bool is_streaming() const override { return streaming_; }
  [[nodiscard]] std::int64_t opening_since_us() const override { return opening_since_us_; }
  [[nodiscard]] const drivers::CameraCounts& counts() const override { return counts_; }
  void on_event(std::function<void(const drivers::CameraEvent&)>) override {}
  void set_exposure(const drivers::ExposureOptions& options) override { *target_grey_ = options.target_grey; }

  // Of the exposure that was set last; outlives the camera.
  [[nodiscard]] std::shared_ptr<std::atomic<double>> target_grey() const { return target_grey_; }

 private:
  bool open(double now_s) {
    opening_since_us_ = std::llround(1e6 * now_s);
    std::this_thread::sleep_for(std::chrono::duration<double>(std::exchange(opening_takes_s_, 0.0)));
    opening_since_us_ = kNotOpening;
    return false;
  }
  void begin(double now_s) {
    if (began_s_ >= 0.0) return;
    began_s_ = now_s;
    double first_s = -1.0;
    if (shutter_ && !shutter_->compare_exchange_strong(first_s, now_s)) began_s_ = first_s;
  }
  void miss_until(double now_s) {
    while (began_s_ + static_cast<double>(shown_) / kFilmRate_hz < now_s) ++shown_;
  }

  std::vector<image_t> images_;
  std::shared_ptr<std::atomic<double>> shutter_;  // when it first opened
  std::shared_ptr<std::atomic<double>> target_grey_ = std::make_shared<std::atomic<double>>(0.0);
  std::int64_t later_us_ = 0;
  double began_s_ = -1.0, away_from_s_ = 1e9, away_to_s_ = 1e9;
  int shown_ = 0;
  double opening_takes_s_ = 0;
  std::atomic<std::int64_t> opening_since_us_{kNotOpening};
  bool loses_stamps_ = false;
  std::atomic<bool> streaming_{true};
  drivers::CameraCounts counts_;
};

class LiveRunTest : public testing::Test {
 protected:
  LiveRunTest() {
    write_camera_file("camera.yaml", "");
    config_.camera.calibration = scratch_.path("camera.yaml");
    config_.camera.rate_hz = kFilmRate_hz;
    config_.lcm.enabled = false;
    config_.realtime.lock_memory = false;
    config_.log.level = "warning";
    hooks_.on_output = [this](const FrameOutput& f) {
      if (f.result.state == slam::State::kNoCamera) {
        silent_.push_back(f);
      } else {
        last_seen_ = f;
        last_seen_state_ = f.result.state;
        ++frames_;
      }
    };
  }

  void write_camera_file(const std::string& name, const std::string& further) {
    std::ofstream(scratch_.path(name)) << "model: pinhole-radtan\nwidth_px: 480\nheight_px: 320\nfx_px: 400\n"
                                          "fy_px: 400\ncx_px: 240\ncy_px: 160\ndistortion: []\nrate_hz: 20\n"
                                       << further;
  }

  // Runs until `enough` returns true, then ends the run by SIGTERM.
  int run(const std::function<bool()>& enough) {
    LiveEnvironment environment;
    environment.camera = std::move(camera_);
    environment.second_camera = std::move(second_camera_);
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
    testing::internal::CaptureStderr();
    const int status = live(
        options_, config_, [this] { return reloaded_; }, std::move(environment));
    stop_took_s_ = steady_s() - stopped_s_;
    printed_ = testing::internal::GetCapturedStdout();
    said_ = printed_ + testing::internal::GetCapturedStderr();
    return status;
  }

  // Why it does not start.
  std::string complaint() {
    try {
      (void)live(options_, config_, {}, {});
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }

  const test::Scratch scratch_;
  Options options_;
  Config config_, reloaded_;
  ThreadHooks hooks_;
  std::unique_ptr<FilmCamera> camera_ = std::make_unique<FilmCamera>(), second_camera_;
  std::atomic<int> frames_{0};
  FrameOutput last_seen_;  // output's thread, read after the run
  std::atomic<slam::State> last_seen_state_{slam::State::kStarting};
  std::vector<FrameOutput> silent_;  // output's thread, read after the run
  double stopped_s_ = 0, stop_took_s_ = 0;
  std::string printed_;  // on standard output
  std::string said_;     // and on standard error: where the log goes, another test may have chosen
};

}  // namespace farpoint::daemon
