// SPDX-License-Identifier: Apache-2.0
// Live runs with two cameras of film: what is counted, what is recorded, and that the second one can go
// without any harm to the first.
#include <gtest/gtest.h>

#include <set>

#include "daemon/config/camera_file.h"
#include "daemon/config/errors.h"
#include "daemon/input/live_camera_options.h"
#include "daemon/replay.h"
#include "ipc/channels.h"
#include "tests/daemon/live_fixture.h"
#include "tests/ipc/log_events.h"

namespace farpoint::daemon {
namespace {

// A camera that looks along the body's x axis, `left_m` to the left of its origin.
std::string placed(double left_m) {
  return "T_body_camera: [0, 0, 1, 0, -1, 0, 0, " + std::to_string(left_m) + ", 0, -1, 0, 0, 0, 0, 0, 1]\n";
}

// Images of the first camera that may still be waiting for the outcome, or came before the second camera's
// first.
constexpr int kUndecided = 8;

class StereoLive : public LiveRunTest {
 protected:
  StereoLive() {
    write_camera_file("camera.yaml", placed(0.1));
    write_camera_file("camera_1.yaml", placed(-0.1));
    config_.camera.second_device = "/dev/video1";
    config_.camera.second_calibration = scratch_.path("camera_1.yaml");
    config_.lcm.status_rate_hz = 100;  // with every frame
    options_.output = scratch_.path("out.lcm");
    second_camera_ = std::make_unique<FilmCamera>();
  }

  [[nodiscard]] std::vector<status_t> status() const {
    return test::messages_of<status_t>(options_.output, ipc::kStatusChannel);
  }
};

TEST_F(StereoLive, ImagesOfOneShutterArePairs) {
  camera_->share_shutter_with(second_camera_.get(), 2'000);
  ASSERT_EQ(run([this] { return frames_ >= 30; }), 0);
  const status_t last = status().back();
  EXPECT_GE(last.stereo_pairs, 30 - kUndecided);
  EXPECT_LE(last.stereo_left_alone, kUndecided);
  EXPECT_EQ(last.stereo_skew_us, 2'000);
  EXPECT_GE(last.frames_received, last.frames_tracked + last.stereo_pairs);
}

TEST_F(StereoLive, ImagesFurtherApartThanToleratedAreNoPairs) {
  camera_->share_shutter_with(second_camera_.get(), 2'000);
  config_.camera.pair_tolerance_us = 1'000;
  ASSERT_EQ(run([this] { return frames_ >= 30; }), 0);
  const status_t last = status().back();
  EXPECT_EQ(last.stereo_pairs, 0);
  EXPECT_GE(last.stereo_left_alone, 30 - kUndecided);
  EXPECT_GE(last.stereo_right_alone, 30 - 2 * kUndecided);
}

TEST_F(StereoLive, WhenTheSecondCameraGoesEveryFrameIsStillTrackedAndCountedAsAlone) {
  camera_->share_shutter_with(second_camera_.get(), 0);
  second_camera_->leave(1.0, 1e9);
  ASSERT_EQ(run([this] { return frames_ >= 50; }), 0);
  EXPECT_TRUE(silent_.empty());
  const auto odometry = test::messages_of<odometry_t>(options_.output, ipc::kOdometryChannel);
  ASSERT_GE(odometry.size(), 50U);
  const status_t last = status().back();
  // One each frame period: what is missing was dropped for the newest, on a machine that is busy.
  const double way_s = 1e-6 * static_cast<double>(odometry.back().utime - odometry.front().utime);
  EXPECT_EQ(last.frames_tracked, static_cast<std::int64_t>(odometry.size()));
  EXPECT_GE(last.frames_tracked + last.frames_dropped, std::lround(way_s * kFilmRate_hz) + 1);
  // The second one gave 20 images.
  EXPECT_LE(last.stereo_pairs, 21);
  EXPECT_GE(last.stereo_pairs, 20 - kUndecided);
  EXPECT_EQ(last.stereo_right_alone, 0);
  EXPECT_GE(last.stereo_pairs + last.stereo_left_alone, last.frames_tracked + last.frames_dropped - 1);
  // Not a state of the vehicle.
  EXPECT_NE(int{last.state}, int{status_t::STATE_NO_CAMERA});
}

TEST_F(StereoLive, ASecondCameraThatComesBackIsPairedAgain) {
  camera_->share_shutter_with(second_camera_.get(), 0);
  second_camera_->leave(0.5, 1.5);
  ASSERT_EQ(run([this] { return frames_ >= 45; }), 0);
  const status_t last = status().back();
  EXPECT_GE(last.stereo_left_alone, 20 - kUndecided);
  EXPECT_GE(last.stereo_pairs, 25 - kUndecided);
}

TEST_F(StereoLive, BothCamerasAreRecordedAndTheLogReplaysToTheSamePoses) {
  camera_->share_shutter_with(second_camera_.get(), 3'000);
  options_.record = scratch_.path("run.lcm");
  options_.live_trajectory = scratch_.path("live.tum");
  ASSERT_EQ(run([this] { return frames_ >= 45; }), 0);

  const auto calibration = test::messages_of<calibration_t>(options_.record, ipc::kCalibrationChannel);
  ASSERT_EQ(calibration.size(), 1U);
  ASSERT_EQ(calibration[0].ncameras, 2);
  EXPECT_EQ(calibration[0].cameras[0].name, "left");
  EXPECT_NEAR(calibration[0].cameras[0].position[1], 0.1, 1e-9);
  EXPECT_NEAR(calibration[0].cameras[1].position[1], -0.1, 1e-9);
  EXPECT_EQ(calibration[0].body_name, "body");
  std::set<std::int64_t> left;
  for (const image_t& image : test::messages_of<image_t>(options_.record, "CAMERA_0"))
    left.insert(image.utime);
  EXPECT_GE(left.size(), 45U);
  const auto right = test::messages_of<image_t>(options_.record, "CAMERA_1");
  ASSERT_GE(right.size(), 40U);
  int partners = 0;
  for (const image_t& image : right) partners += left.contains(image.utime - 3'000) ? 1 : 0;
  EXPECT_GE(partners, 40);
  EXPECT_EQ(right.back().camera, 1);

  Options again;
  again.replay = options_.record;
  again.schedule_log = options_.output;
  again.live_trajectory = scratch_.path("again.tum");
  config_.camera.use = CameraUse::kOne;  // as the live run
  testing::internal::CaptureStdout();
  ASSERT_EQ(replay(again, config_), 0);
  testing::internal::GetCapturedStdout();
  const auto poses = test::read_bytes(options_.live_trajectory);
  EXPECT_GT(poses.size(), 500U);  // it did track
  EXPECT_TRUE(poses == test::read_bytes(again.live_trajectory));
}

TEST_F(StereoLive, HangupSetsTheExposureOfBoth) {
  reloaded_ = config_;
  reloaded_.camera.exposure.target_grey = 77.0;
  const auto first = camera_->target_grey(), second = second_camera_->target_grey();
  bool sent = false;
  hooks_.on_watch = [&] {
    if (sent || frames_ < 5) return;
    sent = true;
    raise(SIGHUP);
  };
  ASSERT_EQ(run([this] { return frames_ >= 15; }), 0);
  EXPECT_EQ(first->load(), 77.0);
  EXPECT_EQ(second->load(), 77.0);
}

TEST_F(StereoLive, WhatIsWrongWithTheSecondCameraIsSaidBeforeItStarts) {
  config_.camera.second_device = "video1";
  EXPECT_NE(complaint().find("camera.second_device: 'video1' names no camera"), std::string::npos)
      << complaint();
  config_.camera.second_device = "/dev/video1";
  config_.camera.second_calibration = "/nonexistent/camera_1.yaml";
  EXPECT_NE(complaint().find("/nonexistent/camera_1.yaml: cannot be opened"), std::string::npos)
      << complaint();
  config_.camera.second_calibration = scratch_.path("camera_1.yaml");
  for (const char* name : {"camera_1.yaml", "camera.yaml"}) {
    write_camera_file("camera.yaml", placed(0.1));
    write_camera_file("camera_1.yaml", placed(-0.1));
    write_camera_file(name, "");
    EXPECT_NE(complaint().find(scratch_.path(name) + ": no T_body_camera, expected it in the files of both"),
              std::string::npos)
        << complaint();
    EXPECT_THROW((void)live(options_, config_, {}, {}), InputError);
  }
}

TEST_F(StereoLive, EachCameraHasItsOwnDeviceAndSize) {
  calibration_t calibration = test::synthetic_calibration();
  calibration.cameras.push_back(calibration.cameras.front());
  calibration.cameras[1].width = 640;
  config_.camera.device = "/dev/video7";
  EXPECT_EQ(camera_options(config_, calibration, 0).device, "/dev/video7");
  EXPECT_EQ(camera_options(config_, calibration, 0).width_px, 480);
  EXPECT_EQ(camera_options(config_, calibration, 1).device, "/dev/video1");
  EXPECT_EQ(camera_options(config_, calibration, 1).width_px, 640);
}

}  // namespace
}  // namespace farpoint::daemon
