// SPDX-License-Identifier: Apache-2.0
// Zurich Urban MAV, on made-up folders of its published layout.
#include "tools/import/zurich.h"

#include <gtest/gtest.h>

#include "tests/tools/tool_support.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

class ImportZurich : public testing::Test {
 protected:
  ImportZurich() {
    std::string gps = "Timpstemp, imgid, lat, lon, alt, s_variance_m_s\n";
    std::string truth = "imgid, x_gt, y_gt, z_gt, omega_gt, phi_gt, kappa_gt, x_gps, y_gps, z_gps\n";
    std::string gyro = "Timpstemp, Error_count, x, y, z, temperature\n", accel = gyro;
    for (int i = 1; i <= 4; ++i) {
      put(root_ / ("MAV Images/0000" + std::to_string(i) + ".jpg"), make_image(".jpg", 64, 48, i));
      const std::string stamp = std::to_string(7'000'000 + 33'333 * i);
      for (int twice = 0; twice < 2; ++twice)
        gps += std::to_string(7'000'000 + 33'333 * i + 5 * twice) + ", " + std::to_string(i) +
               ", 473844060, 85453410, 455000, 0.5\n";
      gyro += stamp + ", 0, 0.01, 0.02, " + std::to_string(i) + ", 40\n";
      accel += std::to_string(7'000'000 + 33'333 * i + 2'000) + ", 0, 0.1, 0.2, -9.8, 40\n";
      if (i != 2)
        truth += std::to_string(i) + ", 465671.5, 5247976.25, " + std::to_string(460 + i) + ", 1, 2, 3\n";
    }
    put(root_ / "Log Files/OnboardGPS.csv", gps);
    put(root_ / "Log Files/GroundTruthAGL.csv", truth);
    put(root_ / "Log Files/RawGyro.csv", gyro);
    put(root_ / "Log Files/RawAccel.csv", accel);
    put(root_ / "camera.yaml",
        "model: pinhole-radtan\nwidth_px: 64\nheight_px: 48\nfx_px: 50\nfy_px: 51\ncx_px: 31\ncy_px: 23\n"
        "distortion: [-0.28, 0.11, -0.001, 0.0002, -0.027]\n");
  }
  [[nodiscard]] Recording read(Damaged damaged = Damaged::kRefused) const {
    return read_zurich(root_.path(), root_ / "camera.yaml", damaged);
  }
  [[nodiscard]] std::string complaint() const {
    return complaint_of([&] { (void)read(); });
  }

  ScratchFolder root_;
};

TEST_F(ImportZurich, ReadsImagesWithTheTimesOfTheirNumbers) {
  put(root_ / "MAV Images/Thumbs.db", "x");
  const Recording r = read();
  ASSERT_EQ(r.images.size(), 4U);
  EXPECT_EQ(r.images[1].utime, 7'066'666) << "the first line that names it";
  EXPECT_EQ(r.images[1].sequence, 2);
  EXPECT_EQ(r.images[1].file.filename(), "00002.jpg");
  EXPECT_NEAR(r.cameras.at(0).rate_hz, 30.0, 0.01);
  EXPECT_TRUE(r.notices.empty());
}

TEST_F(ImportZurich, ReadsImuAndPositions) {
  const Recording r = read();
  ASSERT_EQ(r.imu.size(), 4U);
  EXPECT_EQ(r.imu[1].utime, 7'068'666);
  EXPECT_EQ(r.imu[1].angular_velocity_radps, Eigen::Vector3d(0.01, 0.02, 2.0)) << "the last one before";
  EXPECT_EQ(r.imu[1].acceleration_mps2, Eigen::Vector3d(0.1, 0.2, -9.8));
  EXPECT_FALSE(r.truth_has_orientation);
  ASSERT_EQ(r.truth.size(), 3U);
  EXPECT_EQ(r.truth[1].utime, 7'099'999);
  EXPECT_EQ(r.truth[1].T_world_body.t, Eigen::Vector3d(465671.5, 5247976.25, 463));
}

TEST_F(ImportZurich, ImagesWithoutATimeAreLeftOut) {
  put(root_ / "MAV Images/00077.jpg", make_image(".jpg", 64, 48, 7));
  const Recording r = read();
  EXPECT_EQ(r.images.size(), 4U);
  expect_all_in(r.notices.at(0), {"OnboardGPS.csv: has no time of 1 images"});
}

TEST_F(ImportZurich, ADamagedSensorIsLeftOut) {
  replace_in(root_ / "Log Files/RawAccel.csv", "-9.8", "down");
  replace_in(root_ / "Log Files/GroundTruthAGL.csv", "465671.5", "here");
  const Recording r = read(Damaged::kLeftOut);
  EXPECT_EQ(r.images.size(), 4U);
  EXPECT_TRUE(r.imu.empty() && r.truth.empty());
  ASSERT_EQ(r.notices.size(), 2U);
  expect_all_in(r.notices[0], {"RawAccel.csv:2:", "'down'"});
  expect_all_in(r.notices[1], {"GroundTruthAGL.csv:2:", "'here'"});
}

TEST_F(ImportZurich, SaysWhatIsWrong) {
  replace_in(root_ / "Log Files/OnboardGPS.csv", "7099999, 3", "7000001, 3");
  expect_all_in(complaint(), {"OnboardGPS.csv:6:", "after those above"});
  put(root_ / "Log Files/OnboardGPS.csv", "Timpstemp, imgid\n-5, 1\n");
  expect_all_in(complaint(), {"OnboardGPS.csv:2:", "0 to 9e15"});
  put(root_ / "Log Files/OnboardGPS.csv", "Timpstemp, imgid\n5, 900\n");
  expect_all_in(complaint(), {"OnboardGPS.csv: none of its image numbers"});
  fs::remove(root_ / "Log Files/OnboardGPS.csv");
  expect_all_in(complaint(), {"OnboardGPS.csv: cannot be opened"});
  fs::remove_all(root_ / "MAV Images");
  expect_all_in(complaint(), {"MAV Images: no such folder", "Zurich Urban MAV"});
}

TEST_F(ImportZurich, TheProgramImports) {
  const ProgramResult done =
      run_farpoint_program("import zurich '" + root_.path().string() + "' --camera '" +
                           (root_ / "camera.yaml").string() + "' -o '" + (root_ / "x.lcm").string() + "'");
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_NE(done.out.find("1 camera, 4 images (0 missing)"), std::string::npos) << done.out;
  EXPECT_NE(done.out.find("3 truth positions"), std::string::npos) << done.out;
}

}  // namespace
}  // namespace farpoint::tools
