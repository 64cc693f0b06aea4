// SPDX-License-Identifier: Apache-2.0
// Memory for images is bounded by the configuration.
#include "daemon/config/rig.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <limits>

#include "slam/estimator.h"
#include "tests/daemon/run_daemon.h"
#include "tests/daemon/synthetic_log.h"

namespace farpoint::daemon {
namespace {

calibration_t calibration_of_size(int width_px, int height_px) {
  calibration_t calibration = test::synthetic_calibration();
  camera_calibration_t& camera = calibration.cameras.front();
  const double scale = static_cast<double>(width_px) / camera.width;
  camera.width = width_px;
  camera.height = height_px;
  camera.fx *= scale;
  camera.fy *= scale;
  camera.cx = 0.5 * (width_px - 1);
  camera.cy = 0.5 * (height_px - 1);
  return calibration;
}

std::string refusal_of(int width_px, int height_px, const Config& config) {
  try {
    check_image_size(calibration_of_size(width_px, height_px), config);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(ImageMemory, CommonSizesFitTheDefaults) {
  for (const auto& [width_px, height_px] :
       {std::pair{1241, 376}, {752, 480}, {640, 480}, {1280, 720}, {1280, 960}})
    EXPECT_EQ(refusal_of(width_px, height_px, Config{}), "") << width_px;
}

TEST(ImageMemory, ALargerImageIsRefusedWithTheKey) {
  EXPECT_EQ(
      refusal_of(4096, 4096, Config{}),
      "CALIBRATION, camera 0: images of 4096 x 4096 need 2087 MB with capacity.window_images 24, expected "
      "at most 160 MB (capacity.image_mb)");
  EXPECT_NE(refusal_of(std::numeric_limits<int>::max(), std::numeric_limits<int>::max(), Config{}), "");
  Config config;
  config.image_mb = 300;
  EXPECT_NE(refusal_of(1920, 1080, Config{}), "");
  EXPECT_EQ(refusal_of(1920, 1080, config), "");
}

TEST(ImageMemory, TheEstimatorTakesNoMoreThanCounted) {
  for (const int window_images : {2, 10, 24, 60}) {
    for (const int levels : {1, 4, 8}) {
      Config config;
      config.estimator.capacity.window_images = window_images;
      config.estimator.pyramid.levels = levels;
      const slam::Estimator estimator(config.estimator, make_rig(calibration_of_size(1280, 960), 0));
      double pyramids = 0.0;
      for (const auto& [name, bytes] : estimator.memory_table())
        if (name == "pyramids") pyramids = static_cast<double>(bytes);
      ASSERT_GT(pyramids, 0.0);
      constexpr std::int64_t kPixels = 1280 * 960;
      constexpr double kBesidePyramids = 16.0 * kPixels;
      EXPECT_GE(image_bytes(config, kPixels), pyramids) << window_images << " " << levels;
      EXPECT_LE(image_bytes(config, kPixels), 1.02 * pyramids + kBesidePyramids)
          << window_images << " " << levels;
    }
  }
}

class HugeLog : public testing::Test {
 protected:
  // A log whose calibration and images claim this size.
  std::string write(int width_px, int height_px) {
    const std::string path = scratch_.path("huge.lcm");
    ipc::LogWriter writer(path);
    writer.write_message("CALIBRATION", 0, calibration_of_size(width_px, height_px));
    image_t image{};
    image.width = width_px;
    image.height = height_px;
    image.pixel_format = image_t::PIXEL_FORMAT_PNG;
    image.data = {0x89, 'P', 'N', 'G'};
    image.size = static_cast<std::int32_t>(image.data.size());
    for (int i = 0; i < 3; ++i) {
      image.utime = 100'000 * i;
      writer.write_message("CAMERA_0", 0, image);
    }
    writer.close();
    return path;
  }
  static double peak_mb() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return 1e-3 * static_cast<double>(usage.ru_maxrss);
  }
  const test::Scratch scratch_;
};

TEST_F(HugeLog, IsRefusedInOneLineBeforeMemoryIsTaken) {
  const double before_mb = peak_mb();
  for (const int side_px : {4096, 16384, 46000}) {
    const test::Outcome outcome = test::run_daemon({"--replay", write(side_px, side_px), "--lockstep"});
    EXPECT_EQ(outcome.status, 2);
    EXPECT_EQ(outcome.err_lines(), 1) << outcome.err;
    EXPECT_NE(outcome.err.find("(capacity.image_mb)"), std::string::npos) << outcome.err;
  }
  EXPECT_LT(peak_mb(), before_mb + 60.0);
}

}  // namespace
}  // namespace farpoint::daemon
