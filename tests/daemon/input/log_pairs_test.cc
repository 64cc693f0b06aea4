// SPDX-License-Identifier: Apache-2.0
// A log's images of two cameras become pairs by time, whatever their order in the file.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "daemon/input/log_frame_source.h"
#include "ipc/channels.h"
#include "ipc/log.h"
#include "tests/daemon/synthetic_log.h"
#include "tests/ipc/scratch.h"

namespace farpoint::daemon {
namespace {

constexpr std::int64_t kBegin_us = 1'000'000, kPeriod_us = 100'000;

calibration_t two_cameras() {
  calibration_t calibration = test::synthetic_calibration();
  calibration.cameras.push_back(calibration.cameras.front());
  calibration.cameras.back().position[1] -= 0.4;
  calibration.ncameras = 2;
  return calibration;
}

class LogPairs : public ::testing::Test {
 protected:
  // One of `camera` with an index and an offset in time, in the order of writing.
  struct Shot {
    int camera = 0, number = 0;
    std::int64_t offset_us = 0;
  };
  void write(const std::vector<Shot>& shots, const calibration_t& calibration = two_cameras()) {
    ipc::LogWriter log(path_);
    log.write_message("CALIBRATION", 0, calibration);
    for (const Shot& shot : shots) {
      image_t image = test::synthetic_image({}, shot.number);
      image.utime = kBegin_us + kPeriod_us * shot.number + shot.offset_us;
      image.sequence = shot.number;
      image.camera = static_cast<std::int8_t>(shot.camera);
      log.write_message(shot.camera == 0 ? "CAMERA_0" : "CAMERA_1", image.utime, image);
    }
    log.close();
  }
  // Of each frame: whether it came with a second image.
  [[nodiscard]] std::vector<bool> read(const Config& config = {}) const {
    LogFrameSource source(path_, config);
    StageClock clock;
    SourceFrame frame;
    std::vector<bool> with_second;
    while (source.next(&frame, &clock)) {
      EXPECT_EQ(frame.meta.utime, kBegin_us + kPeriod_us * static_cast<std::int64_t>(with_second.size()));
      with_second.push_back(frame.second != nullptr);
    }
    return with_second;
  }

  test::Scratch scratch_;
  const std::string path_ = scratch_.path("run.lcm");
};

TEST_F(LogPairs, EitherImageMayComeFirst) {
  write({{0, 0}, {1, 0, 2'000}, {1, 1, -3'000}, {0, 1}, {0, 2}, {1, 2}});
  EXPECT_EQ(read(), std::vector<bool>({true, true, true}));
}

TEST_F(LogPairs, AMissingOrDistantSecondImageLeavesTheFrameAlone) {
  write({{0, 0}, {1, 0}, {0, 1}, {1, 1}, {0, 2}, {1, 2}, {0, 3}, {0, 4}, {1, 4, 20'000}, {0, 5}, {1, 5}});
  EXPECT_EQ(read(), std::vector<bool>({true, true, true, false, false, true}));
}

TEST_F(LogPairs, ASecondImageWithoutTheFirstIsPassedOver) {
  write({{1, 0, -kPeriod_us}, {0, 0}, {1, 0}, {0, 1}, {1, 1}});
  EXPECT_EQ(read(), std::vector<bool>({true, true}));
}

TEST_F(LogPairs, OneCameraIsUsedWhereTheKeySaysSoOrTheCamerasStandInOnePlace) {
  write({{0, 0}, {1, 0}, {0, 1}, {1, 1}});
  Config one;
  one.camera.use = CameraUse::kOne;
  EXPECT_EQ(read(one), std::vector<bool>({false, false}));
  calibration_t together = two_cameras();
  together.cameras.back().position[1] += 0.4;
  write({{0, 0}, {1, 0}, {0, 1}, {1, 1}}, together);
  EXPECT_EQ(read(), std::vector<bool>({false, false}));
}

}  // namespace
}  // namespace farpoint::daemon
