// SPDX-License-Identifier: Apache-2.0
// KAIST Urban, on made-up folders of its published layout.
#include "tools/import/kaist.h"

#include <gtest/gtest.h>

#include <numbers>

#include "ipc/image_encoder.h"
#include "tests/ipc/log_events.h"
#include "tests/tools/tool_support.h"
#include "tools/import/recording_log.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kStart_ns = 1'544'582'648'735'119'501;

std::string calibration(const std::string& right_column) {
  return "%YAML:1.0\n---\nimage_width: 64\nimage_height: 48\ncamera_name: left\n"
         "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
         "   data: [ 50., 0., 31., 0., 51., 23., 0., 0., 1. ]\ndistortion_model: plumb_bob\n"
         "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n"
         "   data: [ -0.05, 0.12, 0., 0., 0. ]\nrectification_matrix: !!opencv-matrix\n   rows: 3\n   cols: "
         "3\n"
         "   dt: d\n   data: [ 1., 0., 0., 0., 1., 0., 0., 0., 1. ]\nprojection_matrix: !!opencv-matrix\n"
         "   rows: 3\n   cols: 4\n   dt: d\n   data: [ 50., 0., 31., " +
         right_column + ", 0., 50., 23., 0., 0., 0., 1., 0. ]\n";
}

// A Bayer pattern RGGB of one colour.
std::string bayer(unsigned red, unsigned green, unsigned blue) {
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x)
      pixels.push_back(static_cast<std::uint8_t>(x % 2 != y % 2 ? green : y % 2 == 0 ? red : blue));
  const auto png = ipc::encode_png({64, 48, pixels});
  return {png.begin(), png.end()};
}

class ImportKaist : public testing::Test {
 protected:
  ImportKaist() {
    std::string stamps, imu, encoder, truth;
    for (int i = 0; i < 4; ++i) {
      const std::string stamp = std::to_string(kStart_ns + 100'000'000LL * i);
      stamps += stamp + "\n";
      put(root_ / ("image/stereo_left/" + stamp + ".png"), bayer(40, 80, 120));
      if (i != 2) put(root_ / ("image/stereo_right/" + stamp + ".png"), bayer(0, 0, 200));
      imu += stamp + ",0,0,0,1,1,2,3,0.1,0.2,0.3,9.7,0.5,-0.5,7,8,9\n";
      encoder += stamp + "," + std::to_string(1000 + 100 * i) + "," + std::to_string(2000 + 110 * i) + "\n";
      truth += stamp + ",0,-1,0," + std::to_string(353000.5 + i) + ",1,0,0,4026000,0,0,1,20\n";
    }
    put(root_ / "sensor_data/stereo_stamp.csv", stamps);
    put(root_ / "sensor_data/xsens_imu.csv", imu);
    put(root_ / "sensor_data/encoder.csv", encoder);
    put(root_ / "global_pose.csv", truth);
    put(root_ / "calibration/left.yaml", calibration("0."));
    put(root_ / "calibration/right.yaml", calibration("-25."));
    put(root_ / "calibration/Vehicle2Stereo.txt", "R: 0 0 1 -1 0 0 0 -1 0\nT: 1.6 0.25 1.5\n");
    put(root_ / "calibration/Vehicle2IMU.txt", "R: 1 0 0 0 1 0 0 0 1\nT: -0.07 0 1.7\n");
    put(root_ / "calibration/EncoderParameter.txt",
        "Encoder calibrated parameter\n"
        "Encoder resolution: 4096\nEncoder left wheel diameter: 0.62\n"
        "Encoder right wheel diameter: 0.64\nEncoder wheel base: 1.5\n");
  }
  [[nodiscard]] Recording read(Damaged damaged = Damaged::kRefused) const {
    return read_kaist(root_.path(), damaged);
  }
  [[nodiscard]] std::string complaint() const {
    return complaint_of([&] { (void)read(); });
  }

  ScratchFolder root_;
};

TEST_F(ImportKaist, ReadsCamerasOnTheVehicle) {
  const Recording r = read();
  EXPECT_EQ(r.body_name, "vehicle");
  ASSERT_EQ(r.cameras.size(), 2U);
  EXPECT_EQ(r.cameras[0].parameters.fy_px, 51.0);
  EXPECT_EQ(r.cameras[0].parameters.distortion[1], 0.12);
  EXPECT_NEAR(r.cameras[0].rate_hz, 10.0, 1e-9);
  EXPECT_TRUE(
      (r.cameras[0].T_body_camera * Eigen::Vector3d(0, 0, 1)).isApprox(Eigen::Vector3d(2.6, 0.25, 1.5)));
  EXPECT_TRUE(r.cameras[1].T_body_camera.t.isApprox(Eigen::Vector3d(1.6, -0.25, 1.5)))
      << "0.5 m to the right";
  ASSERT_EQ(r.images.size(), 7U);
  EXPECT_EQ(r.missing_images, 1U);
  EXPECT_EQ(r.images[0].utime, 1'544'582'648'735'120) << "rounded";
  EXPECT_EQ(r.images[1].camera, 1);
  EXPECT_EQ(r.images[5].sequence, 3);
}

TEST_F(ImportKaist, ReadsImuWheelsAndTruth) {
  const Recording r = read();
  ASSERT_EQ(r.imu.size(), 4U);
  EXPECT_EQ(r.imu[0].angular_velocity_radps, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(r.imu[0].acceleration_mps2, Eigen::Vector3d(9.7, 0.5, -0.5));
  EXPECT_EQ(r.imu_calibration.value().T_body_imu.t.x(), -0.07);
  ASSERT_EQ(r.wheels.size(), 3U);
  EXPECT_EQ(r.wheels[0].utime, 1'544'582'648'785'120) << "half way";
  const double left = std::numbers::pi * 0.62 * 100.0 / 4096.0 / 0.1;
  const double right = std::numbers::pi * 0.64 * 110.0 / 4096.0 / 0.1;
  EXPECT_NEAR(r.wheels[0].speed_mps, 0.5 * (left + right), 1e-9);
  EXPECT_NEAR(r.wheels[0].yaw_rate_radps, (right - left) / 1.5, 1e-9) << "a faster right wheel turns left";
  ASSERT_EQ(r.truth.size(), 4U);
  EXPECT_EQ(r.truth[1].T_world_body.t, Eigen::Vector3d(353001.5, 4026000, 20));
  EXPECT_TRUE((r.truth[1].T_world_body.q * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(0, 1, 0)));
}

// A pattern taken for grey would be a chessboard to every corner detector.
TEST_F(ImportKaist, BayerPatternsBecomeOneGrey) {
  const ProgramResult done = run_farpoint_program("import kaist '" + root_.path().string() + "' -o '" +
                                                  (root_ / "run.lcm").string() + "'");
  ASSERT_EQ(done.status, 0) << done.err;
  for (const auto& [channel, grey] : {std::pair{"CAMERA_0", 80}, {"CAMERA_1", 50}}) {
    for (const image_t& image : test::messages_of<image_t>((root_ / "run.lcm").string(), channel)) {
      ipc::ImageDecoder decoder;
      ipc::GreyImage pixels;
      ASSERT_EQ(decoder.decode(image, &pixels), ipc::ImageStatus::kOk);
      EXPECT_EQ(pixels.pixels, std::vector<std::uint8_t>(64 * 48, static_cast<std::uint8_t>(grey)));
    }
  }
}

TEST_F(ImportKaist, OneCameraAndNoSensorsAreEnough) {
  fs::remove_all(root_ / "image/stereo_right");
  for (const char* file : {"sensor_data/xsens_imu.csv", "sensor_data/encoder.csv", "global_pose.csv",
                           "calibration/right.yaml", "calibration/Vehicle2IMU.txt"})
    fs::remove(root_ / file);
  const Recording r = read();
  EXPECT_EQ(r.cameras.size(), 1U);
  EXPECT_EQ(r.images.size(), 4U);
  EXPECT_EQ(r.missing_images, 0U);
  EXPECT_FALSE(r.imu_calibration.has_value());
}

TEST_F(ImportKaist, ADamagedSensorIsLeftOut) {
  replace_in(root_ / "sensor_data/xsens_imu.csv", "9.7", "fast");
  replace_in(root_ / "calibration/EncoderParameter.txt", "resolution: 4096", "resolution: 0");
  replace_in(root_ / "global_pose.csv", ",0,-1,0,", ",0,-2,0,");
  const Recording r = read(Damaged::kLeftOut);
  EXPECT_EQ(r.images.size(), 7U);
  EXPECT_TRUE(r.imu.empty() && r.wheels.empty() && r.truth.empty());
  EXPECT_FALSE(r.imu_calibration.has_value());
  ASSERT_EQ(r.notices.size(), 3U);
  expect_all_in(r.notices[0], {"xsens_imu.csv:1:", "'fast'"});
  expect_all_in(r.notices[1], {"EncoderParameter.txt", "'Encoder resolution: number' above 0"});
  expect_all_in(r.notices[2], {"global_pose.csv:1:", "rotation"});
}

TEST_F(ImportKaist, SaysWhatIsWrong) {
  replace_in(root_ / "calibration/right.yaml", "-25.", "0.");
  expect_all_in(complaint(), {"right.yaml", "rectification of a pair"});
  fs::remove(root_ / "calibration/right.yaml");
  expect_all_in(complaint(), {"right.yaml: cannot be opened"});
  put(root_ / "calibration/Vehicle2Stereo.txt", "R: 1 0 0 0 1 0 0 0 2\nT: 0 0 0\n");
  expect_all_in(complaint(), {"Vehicle2Stereo.txt", "'R: ' with a rotation"});
  put(root_ / "calibration/Vehicle2Stereo.txt", "R: 1 0 0\n");
  expect_all_in(complaint(), {"Vehicle2Stereo.txt:1:", "expected 10 fields"});
  fs::remove_all(root_ / "image/stereo_left");
  expect_all_in(complaint(), {"stereo_left: no such folder", "KAIST Urban"});
}

TEST_F(ImportKaist, StampsAreCheckedWithTheirLine) {
  replace_in(root_ / "sensor_data/stereo_stamp.csv", "8835119501", "8635119501");
  expect_all_in(complaint(), {"stereo_stamp.csv:2:", "after the one above"});
  put(root_ / "sensor_data/stereo_stamp.csv", "5\n");
  expect_all_in(complaint(), {"stereo_stamp.csv: none of its stamps", "stereo_left"});
}

}  // namespace
}  // namespace farpoint::tools
