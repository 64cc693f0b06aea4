// SPDX-License-Identifier: Apache-2.0
// The example vehicles of config/vehicles: each is complete, and nothing in it is refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "daemon/config/camera_file.h"
#include "daemon/config/config.h"
#include "daemon/config/rig.h"
#include "drivers/can/wheel_signals.h"
#include "tests/support/paths.h"

namespace farpoint::daemon {
namespace {

namespace fs = std::filesystem;

class Vehicle : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    load_config_file(file("farpoint.yaml"), &config_, &origins_);
    check_relations(config_, origins_);
  }
  [[nodiscard]] fs::path folder() const {
    return fs::path(test::source_dir()) / "config" / "vehicles" / GetParam();
  }
  [[nodiscard]] std::string file(const std::string& name) const { return (folder() / name).string(); }
  // A file that the configuration names in /etc/farpoint stands beside it.
  [[nodiscard]] std::string beside(const std::string& installed) const {
    EXPECT_EQ(fs::path(installed).parent_path(), "/etc/farpoint");
    return file(fs::path(installed).filename().string());
  }
  [[nodiscard]] calibration_t calibration(std::vector<std::string>* notices) const {
    const std::string first = beside(config_.camera.calibration);
    if (config_.camera.has_second())
      return read_stereo_calibration(first, beside(config_.camera.second_calibration), notices);
    const CameraFile camera = read_camera_file(first);
    *notices = camera.notices;
    return calibration_of(camera, "front");
  }

  Config config_;
  ConfigOrigins origins_;
};

TEST_P(Vehicle, ConfigurationAndCamerasFitTogether) {
  std::vector<std::string> notices;
  const calibration_t cameras = calibration(&notices);
  EXPECT_TRUE(notices.empty()) << notices.front();
  EXPECT_NO_THROW(check_image_size(cameras, config_));
  for (int i = 0; i < cameras.ncameras; ++i) EXPECT_NO_THROW((void)make_rig(cameras, i)) << i;
  for (const camera_calibration_t& camera : cameras.cameras)
    EXPECT_EQ(camera.rate_hz, config_.camera.rate_hz)
        << "the camera file's rate is that of the configuration";
}

TEST_P(Vehicle, EveryFileOfTheFolderIsOneThatTheConfigurationNames) {
  std::vector<std::string> named = {"farpoint.yaml", fs::path(config_.camera.calibration).filename()};
  if (config_.camera.has_second()) named.emplace_back(fs::path(config_.camera.second_calibration).filename());
  if (config_.can.wheels_dbc != "none") named.emplace_back(fs::path(config_.can.wheels_dbc).filename());
  std::size_t present = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder())) {
    ++present;
    EXPECT_NE(std::find(named.begin(), named.end(), entry.path().filename()), named.end()) << entry.path();
  }
  EXPECT_EQ(present, named.size());
}

TEST_P(Vehicle, WheelSignalsStandInTheDbcFile) {
  EXPECT_EQ(config_.can.wheels_dbc != "none", GetParam() == "car");
  if (config_.can.wheels_dbc == "none") return;
  const std::vector<drivers::WheelSignal> wheels =
      drivers::read_wheel_signals(beside(config_.can.wheels_dbc), config_.can.wheel_signals);
  EXPECT_EQ(wheels.size(), 4U);
}

INSTANTIATE_TEST_SUITE_P(Examples, Vehicle, testing::Values("car", "rover", "drone"),
                         [](const testing::TestParamInfo<std::string>& info) { return info.param; });

TEST(Vehicles, TheRoversCamerasAreABaselineApart) {
  const fs::path folder = fs::path(test::source_dir()) / "config/vehicles/rover";
  const CameraFile left = read_camera_file(folder / "camera.yaml"),
                   right = read_camera_file(folder / "camera_1.yaml");
  ASSERT_TRUE(left.T_body_camera && right.T_body_camera);
  EXPECT_NEAR((left.T_body_camera->t - right.T_body_camera->t).norm(), 0.12, 1e-12);
}

}  // namespace
}  // namespace farpoint::daemon
