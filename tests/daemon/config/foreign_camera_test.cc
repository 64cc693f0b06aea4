// SPDX-License-Identifier: Apache-2.0
// Calibrations as ROS, Kalibr and OpenCV write them: what is read, the error of a conversion against the
// models' own formulas, and what is said about wrong ones.
#include "daemon/config/foreign_camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "daemon/config/camera_file.h"
#include "daemon/config/errors.h"
#include "slam/geometry/camera.h"
#include "tests/ipc/scratch.h"

namespace farpoint::daemon {
namespace {

// ---- the tools' own layouts ----

std::string ros(const std::string& model, const std::string& coefficients, int count,
                const std::string& width = "752") {
  return "image_width: " + width +
         "\nimage_height: 480\ncamera_name: narrow_stereo\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
         "  data: [458.654, 0.     , 367.215,\n           0.     , 457.296, 248.375,\n"
         "           0.     , 0.     , 1.     ]\ndistortion_model: " +
         model + "\ndistortion_coefficients:\n  rows: 1\n  cols: " + std::to_string(count) + "\n  data: [" +
         coefficients +
         "]\nrectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1., 0., 0., 0., 1., 0., 0., 0., 1.]\n"
         "projection_matrix:\n  rows: 3\n  cols: 4\n  data: [450., 0., 367., 0., 0., 450., 248., 0., 0., 0., "
         "1., "
         "0.]\n";
}

std::string kalibr_camera(const std::string& name, const std::string& model, const std::string& intrinsics,
                          const std::string& distortion, const std::string& coefficients,
                          const std::string& motion = "") {
  return name + ":\n  cam_overlaps: [1]\n  camera_model: " + model + "\n  distortion_coeffs: [" +
         coefficients + "]\n  distortion_model: " + distortion + "\n  intrinsics: [" + intrinsics +
         "]\n  resolution: [752, 480]\n  rostopic: /" + name + "/image_raw\n" + motion;
}

const char* const kMotion =
    "  T_cn_cnm1:\n  - [1.0, 0.0, 0.0, -0.11]\n  - [0.0, 1.0, 0.0, 0.02]\n  - [0.0, 0.0, 1.0, 0.003]\n"
    "  - [0.0, 0.0, 0.0, 1.0]\n";
const char* const kRational = "0.4718, -2.4778, 0.0005, -0.0002, 1.4446, 0.3489, -2.3065, 1.3758";

CameraFile parse(const std::string& text, const std::string& name = "") {
  return parse_camera_file(text, "calib.yaml", name);
}

std::string complaint_of(const std::string& text, const std::string& name = "") {
  try {
    (void)parse(text, name);
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  ADD_FAILURE() << "accepted:\n" << text;
  return "";
}

void expect_parts(const std::string& message, const std::vector<std::string>& parts) {
  for (const std::string& part : parts) EXPECT_NE(message.find(part), std::string::npos) << message;
}

// The figures that a conversion's notice states.
struct Stated {
  double rms_px = -1.0, max_px = -1.0;
};
Stated stated_error(const CameraFile& camera) {
  Stated stated;
  for (const std::string& notice : camera.notices) {
    const std::size_t at = notice.find("error ");
    if (at == std::string::npos) continue;
    EXPECT_EQ(
        std::sscanf(notice.c_str() + at, "error %lf px RMS, %lf px at most", &stated.rms_px, &stated.max_px),
        2);
  }
  return stated;
}

// Holds the camera against the model's own inverse over the image: angles in pixels of the focal length.
using Unproject = std::function<Eigen::Vector3d(const Eigen::Vector2d& pixel)>;
void expect_rays(const CameraFile& file, const Unproject& reference) {
  const slam::Camera camera(file.parameters);
  double worst_px = 0.0;
  int used = 0;
  for (int v = 0; v < camera.height_px(); v += 20) {
    for (int u = 0; u < camera.width_px(); u += 20) {
      const Eigen::Vector2d pixel(u, v);
      const Eigen::Vector3d ray = reference(pixel);
      if (!ray.allFinite()) continue;  // beyond the lens
      ++used;
      Eigen::Vector2d back;
      ASSERT_TRUE(camera.project(ray, &back)) << pixel.transpose();
      worst_px = std::max(worst_px, (back - pixel).norm());
    }
  }
  const Stated stated = stated_error(file);
  EXPECT_LE(worst_px, 1.1 * stated.max_px + 1e-3) << "the stated error";
  EXPECT_GE(worst_px, 0.5 * stated.max_px - 2e-3);
  EXPECT_GT(used, 500);
  EXPECT_LT(stated.max_px, kMaxConversionError_px);
}

// ---- ROS ----

TEST(RosCalibration, ReadsTheFileOfTheCalibrator) {
  const CameraFile c = parse(ros("plumb_bob", "-0.28, 0.07, 0.0002, 1.76e-05, 0.", 5));
  EXPECT_EQ(c.parameters.model, slam::CameraModel::kPinholeRadtan);
  EXPECT_EQ(c.parameters.width_px, 752);
  EXPECT_EQ(c.parameters.height_px, 480);
  EXPECT_EQ(c.parameters.fx_px, 458.654);
  EXPECT_EQ(c.parameters.fy_px, 457.296);
  EXPECT_EQ(c.parameters.cx_px, 367.215);
  EXPECT_EQ(c.parameters.cy_px, 248.375);
  EXPECT_EQ(c.parameters.distortion, (std::array<double, 5>{-0.28, 0.07, 0.0002, 1.76e-05, 0.0}));
  EXPECT_FALSE(c.T_body_camera);
  EXPECT_TRUE(c.notices.empty());
}

TEST(RosCalibration, ReadsAMessageAsTheTopicPrintsIt) {
  for (const bool ros2 : {false, true}) {
    const std::string d = ros2 ? "d" : "D", k = ros2 ? "k" : "K";
    const CameraFile c = parse(
        "header:\n  stamp:\n    sec: 1\n  frame_id: cam\nheight: 480\nwidth: 640\n"
        "distortion_model: plumb_bob\n" +
        d + ":\n- 0.1\n- -0.2\n- 0.0\n- 0.0\n- 0.0\n" + k +
        ": [600.0, 0.0, 320.0, 0.0, 601.0, 240.0, 0.0, 0.0, 1.0]\nbinning_x: 0\nroi:\n"
        "  x_offset: 0\n  y_offset: 0\n  height: 0\n  width: 0\n  do_rectify: false\n---\n");
    EXPECT_EQ(c.parameters.fy_px, 601.0);
    EXPECT_EQ(c.parameters.distortion[1], -0.2);
  }
}

TEST(RosCalibration, EquidistantIsKannalaBrandt) {
  const CameraFile c = parse(ros("equidistant", "-0.01, 0.02, -0.003, 0.0004", 4));
  EXPECT_EQ(c.parameters.model, slam::CameraModel::kKannalaBrandt);
  EXPECT_EQ(c.parameters.distortion, (std::array<double, 5>{-0.01, 0.02, -0.003, 0.0004, 0.0}));
  EXPECT_TRUE(c.notices.empty()) << "nothing is converted";
}

TEST(RosCalibration, RationalPolynomialIsConvertedWithinItsStatedError) {
  const CameraFile c = parse(ros("rational_polynomial", kRational, 8));
  const cv::Matx33d k(458.654, 0, 367.215, 0, 457.296, 248.375, 0, 0, 1);
  const std::vector<double> d = {0.4718, -2.4778, 0.0005, -0.0002, 1.4446, 0.3489, -2.3065, 1.3758};
  // OpenCV's own projection of a grid of rays. Where they meet the image is the error.
  const slam::Camera camera(c.parameters);
  double worst_px = 0.0;
  for (double x = -0.8; x <= 0.8; x += 0.05) {
    for (double y = -0.55; y <= 0.55; y += 0.05) {
      std::vector<cv::Point2d> pixels;
      cv::projectPoints(std::vector<cv::Point3d>{{x, y, 1.0}}, cv::Vec3d(), cv::Vec3d(), k, d, pixels);
      const Eigen::Vector2d expected(pixels[0].x, pixels[0].y);
      if (!camera.in_image(expected)) continue;
      Eigen::Vector2d pixel;
      ASSERT_TRUE(camera.project({x, y, 1.0}, &pixel));
      worst_px = std::max(worst_px, (pixel - expected).norm());
    }
  }
  const Stated stated = stated_error(c);
  EXPECT_GT(stated.max_px, 0.0);
  EXPECT_LT(stated.rms_px, stated.max_px);
  EXPECT_LE(worst_px, 1.1 * stated.max_px);
  EXPECT_GE(worst_px, 0.5 * stated.max_px);
}

TEST(RosCalibration, RationalWithoutDenominatorIsExact) {
  const CameraFile c = parse(ros("rational_polynomial", "-0.28, 0.07, 0.0002, 1e-05, 0.1, 0., 0., 0.", 8));
  EXPECT_EQ(c.parameters.distortion, (std::array<double, 5>{-0.28, 0.07, 0.0002, 1e-05, 0.1}));
  EXPECT_TRUE(c.notices.empty());
}

// ---- Kalibr ----

TEST(KalibrChain, ReadsEveryCameraAndWhereItStands) {
  const std::string chain =
      kalibr_camera("cam0", "pinhole", "458, 457, 367, 248", "radtan", "-0.28, 0.07, 0.0002, 1.76e-05") +
      kalibr_camera("cam1", "pinhole", "461, 460, 362, 246", "equi", "-0.01, 0.02, -0.003, 0.0004", kMotion);
  const CameraFile first = parse(chain);
  EXPECT_EQ(first.parameters.fx_px, 458.0);
  EXPECT_EQ(first.parameters.distortion[3], 1.76e-05);
  ASSERT_EQ(first.notices.size(), 1U);
  expect_parts(first.notices[0], {"cam0 of 2 cameras", "calib.yaml#cam1"});
  const CameraFile second = parse(chain, "cam1");
  EXPECT_EQ(second.parameters.model, slam::CameraModel::kKannalaBrandt);
  EXPECT_EQ(second.parameters.fx_px, 461.0);
  EXPECT_TRUE(second.notices.empty());
  // cam1 stands 0.11 m to the right of cam0 (camera x), 0.02 m above it (camera -y) and 3 mm behind: body
  // axes.
  ASSERT_TRUE(first.T_body_camera && second.T_body_camera);
  EXPECT_TRUE(first.T_body_camera->t.isZero());
  EXPECT_TRUE(second.T_body_camera->t.isApprox(Eigen::Vector3d(-0.003, -0.11, 0.02)));
  const CameraFile mounted = parse(chain + "mount: {x_m: 2, z_m: 1}\n", "cam1");
  EXPECT_TRUE(mounted.T_body_camera->t.isApprox(Eigen::Vector3d(1.997, -0.11, 1.02)));
  EXPECT_FALSE(parse(kalibr_camera("cam0", "pinhole", "458, 457, 367, 248", "none", "")).T_body_camera);
}

TEST(KalibrChain, AStereoPairIsReadFromOneChain) {
  const test::Scratch scratch;
  const std::string file = scratch.path("chain.yaml");
  std::ofstream(file) << kalibr_camera("cam0", "pinhole", "458, 457, 367, 248", "radtan", "0, 0, 0, 0")
                      << kalibr_camera("cam1", "pinhole", "461, 460, 362, 246", "radtan", "0, 0, 0, 0",
                                       kMotion);
  std::vector<std::string> notices;
  const calibration_t pair = read_stereo_calibration(file + "#cam0", file + "#cam1", &notices);
  ASSERT_EQ(pair.ncameras, 2);
  EXPECT_NEAR(pair.cameras[1].position[1] - pair.cameras[0].position[1], -0.11, 1e-12);
  EXPECT_TRUE(notices.empty());
}

// Aliases make a short text long: 2 MB here, 40 GB with a thousand times as many.
TEST(KalibrChain, AMotionOfTooManyNumbersIsRefusedBeforeTheyAreRead) {
  std::string row = "[1.0", motion = "  T_cn_cnm1:\n  - &a ";
  for (int i = 0; i < 2000; ++i) row += ", 1.0";
  motion += row + "]\n";
  for (int i = 0; i < 2000; ++i) motion += "  - *a\n";
  const std::string chain =
      kalibr_camera("cam0", "pinhole", "460, 459, 370, 250", "radtan", "0, 0, 0, 0") +
      kalibr_camera("cam1", "pinhole", "460, 459, 370, 250", "radtan", "0, 0, 0, 0", motion);
  expect_parts(complaint_of(chain, "cam1"), {"calib.yaml:", "4 rows of 4 numbers", "T_cn_cnm1"});
}

TEST(KalibrChain, DoubleSphereIsConvertedWithinItsStatedError) {
  const double xi = -0.27, alpha = 0.57;
  const CameraFile c = parse(kalibr_camera("cam0", "ds", "-0.27, 0.57, 150, 151, 370, 240", "none", ""));
  EXPECT_EQ(c.parameters.model, slam::CameraModel::kKannalaBrandt);
  expect_rays(c, [&](const Eigen::Vector2d& pixel) {
    // Closed inverse, Usenko et al. 2018, eq. 46 to 52.
    const double mx = (pixel.x() - 370) / 150, my = (pixel.y() - 240) / 151, r2 = mx * mx + my * my;
    const double mz = (1 - alpha * alpha * r2) / (alpha * std::sqrt(1 - (2 * alpha - 1) * r2) + 1 - alpha);
    const double s = (mz * xi + std::sqrt(mz * mz + (1 - xi * xi) * r2)) / (mz * mz + r2);
    return Eigen::Vector3d(s * mx, s * my, s * mz - xi);
  });
}

TEST(KalibrChain, ExtendedUnifiedIsConvertedWithinItsStatedError) {
  const double alpha = 0.6, beta = 1.1;
  const CameraFile c = parse(kalibr_camera("cam0", "eucm", "0.6, 1.1, 250, 251, 370, 240", "none", ""));
  expect_rays(c, [&](const Eigen::Vector2d& pixel) {
    const double mx = (pixel.x() - 370) / 250, my = (pixel.y() - 240) / 251, r2 = mx * mx + my * my;
    const double mz =
        (1 - beta * alpha * alpha * r2) / (alpha * std::sqrt(1 - (2 * alpha - 1) * beta * r2) + 1 - alpha);
    return Eigen::Vector3d(mx, my, mz);
  });
}

TEST(KalibrChain, OmniIsConvertedWithinItsStatedError) {
  const double xi = 1.2;
  const CameraFile c =
      parse(kalibr_camera("cam0", "omni", "1.2, 600, 601, 370, 240", "radtan", "0, 0, 0, 0"));
  expect_rays(c, [&](const Eigen::Vector2d& pixel) {
    const double mx = (pixel.x() - 370) / 600, my = (pixel.y() - 240) / 601, r2 = mx * mx + my * my;
    const double s = (xi + std::sqrt(1 + (1 - xi * xi) * r2)) / (1 + r2);
    return Eigen::Vector3d(s * mx, s * my, s - xi);
  });
}

TEST(KalibrChain, FieldOfViewIsConvertedWithinItsStatedError) {
  const double w = 0.92;
  const CameraFile c = parse(kalibr_camera("cam0", "pinhole", "300, 301, 370, 240", "fov", "0.92"));
  expect_rays(c, [&](const Eigen::Vector2d& pixel) {
    const double mx = (pixel.x() - 370) / 300, my = (pixel.y() - 240) / 301, rd = std::hypot(mx, my);
    const double ru = std::tan(rd * w) / (2 * std::tan(w / 2));
    const double s = rd > 0 ? ru / rd : 0.0;
    return Eigen::Vector3d(s * mx, s * my, 1.0);
  });
}

// ---- OpenCV ----

// Written by OpenCV itself.
std::string opencv_text(const std::vector<double>& coefficients, int fisheye,
                        const char* extension = ".yml") {
  cv::FileStorage storage(extension, cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  storage << "calibration_time"
          << "Thu 02 Jan 2025 10:11:12 AM UTC"
          << "image_width" << 640 << "image_height" << 480 << "board_width" << 9 << "square_size" << 0.025;
  if (fisheye >= 0) storage << "fisheye_model" << fisheye;
  storage << "camera_matrix" << cv::Mat(cv::Matx33d(520.5, 0, 320.25, 0, 521.5, 239.75, 0, 0, 1))
          << "distortion_coefficients" << cv::Mat(coefficients, true) << "avg_reprojection_error" << 0.21;
  return storage.releaseAndGetString();
}

TEST(OpenCvCalibration, ReadsWhatFileStorageWrites) {
  const std::string text = opencv_text({0.26, -0.95, -0.005, 0.0026, 1.16}, -1);
  EXPECT_TRUE(text.starts_with("%YAML:1.0")) << text;
  const CameraFile c = parse(text);
  EXPECT_EQ(c.parameters.model, slam::CameraModel::kPinholeRadtan);
  EXPECT_EQ(c.parameters.fx_px, 520.5);
  EXPECT_EQ(c.parameters.cy_px, 239.75);
  EXPECT_EQ(c.parameters.distortion, (std::array<double, 5>{0.26, -0.95, -0.005, 0.0026, 1.16}));
  const CameraFile fisheye = parse(opencv_text({0.01, 0.02, 0.003, 0.004}, 1));
  EXPECT_EQ(fisheye.parameters.model, slam::CameraModel::kKannalaBrandt);
  EXPECT_EQ(parse(opencv_text({0.01, 0.02, 0.003, 0.004}, 0)).parameters.model,
            slam::CameraModel::kPinholeRadtan);
  const CameraFile tilted = parse(opencv_text({0.26, -0.9, 0, 0, 1.1, 0, 0, 0, 0, 0, 0, 0, 0, 0}, -1));
  EXPECT_EQ(tilted.parameters.distortion[4], 1.1);
}

TEST(OpenCvCalibration, SaysWhatCannotBeRead) {
  expect_parts(complaint_of(opencv_text({0.01, 0.02, 0.003, 0.004}, -1)),
               {"calib.yaml:", "fisheye_model: 0 or 1"});
  expect_parts(complaint_of(opencv_text({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.1, 0}, -1)),
               {"calib.yaml:", "14"});
  expect_parts(complaint_of(opencv_text({0, 0, 0, 0, 0}, -1, ".xml")), {"calib.yaml: XML", "YAML"});
  const std::string text = opencv_text({0, 0, 0, 0, 0}, -1);
  expect_parts(complaint_of(std::string(text).replace(text.find("image_width"), 11, "image_girth")),
               {"'image_width' is missing"});
}

// ---- wrong ones ----

TEST(ForeignCalibration, WrongOnesAreNamedWithLineAndWhatWasExpected) {
  const std::string good = ros("plumb_bob", "0, 0, 0, 0, 0", 5);
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    return text.replace(text.find(from), from.size(), to);
  };
  expect_parts(complaint_of(with("plumb_bob", "thin_prism")),
               {"calib.yaml:10:", "'thin_prism'", "rational_polynomial"});
  expect_parts(complaint_of(ros("plumb_bob", "0, 0, 0", 3)), {"calib.yaml:12:", "found 3"});
  expect_parts(complaint_of(ros("plumb_bob", "0, 0, 0, 0, 0", 6)), {"rows x cols", "found 5"});
  expect_parts(complaint_of(ros("plumb_bob", "0, 0, .nan, 0, 0", 5)), {"calib.yaml:14:", "finite"});
  expect_parts(complaint_of(ros("equidistant", "0, 0, 0, 0, 0", 5)), {"k1 k2 k3 k4", "found 5"});
  expect_parts(complaint_of(with("458.654", "0")), {"calib.yaml:5:", "not calibrated"});
  expect_parts(complaint_of(with("458.654, 0. ", "458.654, 3. ")), {"without skew"});
  expect_parts(complaint_of(with("248.375", "948.375")), {"calib.yaml", "cy is 948.375"});
  expect_parts(complaint_of(with("  data: [458", "  dita: [458")), {"calib.yaml:5:", "rows, cols and data"});
  expect_parts(complaint_of(good + "binning_x: 2\n"), {"binning_x", "whole images"});
  expect_parts(complaint_of(good + "roi: {x_offset: 8}\n"), {"roi.x_offset 0"});
  expect_parts(complaint_of(ros("plumb_bob", "0, 0, 0, 0, 0", 5, "2000000000")),
               {"width is 2000000000", "16384"});
  expect_parts(complaint_of(good, "cam1"), {"no camera 'cam1'", "camchain"});
  expect_parts(complaint_of("# oST version 5.0 parameters\n[image]\n"), {"INI"});
  const std::string chain = kalibr_camera("cam0", "pinhole", "458, 457, 367, 248", "radtan", "0, 0, 0, 0");
  expect_parts(complaint_of(chain, "cam3"), {"no camera 'cam3'", "cam0"});
  expect_parts(complaint_of("cam0: 7\n"), {"calib.yaml:1:", "keys of a camera"});
  expect_parts(complaint_of("cam0: {}\n"), {"calib.yaml:1:", "'camera_model' is missing"});
  expect_parts(complaint_of(kalibr_camera("cam0", "ds", "458, 457, 367, 248", "none", "")),
               {"6 numbers", "found 4"});
  expect_parts(complaint_of(kalibr_camera("cam0", "pinhole", "458, 457, 367, 248", "wide", "0")),
               {"'wide'", "radtan"});
  expect_parts(complaint_of(chain + kalibr_camera("cam1", "pinhole", "4, 4, 3, 2", "none", ""), "cam1"),
               {"'T_cn_cnm1' is missing"});
  std::string skewed = kMotion;
  skewed.replace(skewed.find("1.0"), 3, "1.5");
  expect_parts(
      complaint_of(chain + kalibr_camera("cam1", "pinhole", "4, 4, 3, 2", "none", "", skewed), "cam1"),
      {"calib.yaml:18:", "rotation and a translation"});
}

TEST(ForeignCalibration, AConversionThatIsNotGoodEnoughIsRefusedWithItsError) {
  // Thin prism and decentring of this size have no place in the supported models.
  const std::string text =
      complaint_of(ros("rational_polynomial", "0, 0, 0, 0, 0, 0, 0, 0, 0.05, 0, 0, 0", 12));
  expect_parts(text, {"calib.yaml: rational polynomial as ", " px RMS, ", "expected at most 1 px"});
  // A distortion that folds near the centre.
  expect_parts(complaint_of(ros("rational_polynomial", "-40, 0, 0, 0, 0, 0.001, 0, 0", 8)), {"no rays"});
}

// ---- mounting and absurd cameras ----

TEST(CameraMount, IsAnotherWayToWriteTheBodysTransform) {
  const std::string good = ros("plumb_bob", "0, 0, 0, 0, 0", 5);
  const CameraFile c =
      parse(good + "mount: {x_m: 1.5, y_m: -0.2, z_m: 1.1, roll_deg: 0, pitch_deg: 10, yaw_deg: 90}\n");
  ASSERT_TRUE(c.T_body_camera);
  EXPECT_TRUE(c.T_body_camera->t.isApprox(Eigen::Vector3d(1.5, -0.2, 1.1)));
  // It looks to the left, 10 degrees down; its right is the body's front.
  const double down = 10.0 * M_PI / 180.0;
  EXPECT_TRUE((c.T_body_camera->q * Eigen::Vector3d(0, 0, 1))
                  .isApprox(Eigen::Vector3d(0, std::cos(down), -std::sin(down)), 1e-12));
  EXPECT_TRUE((c.T_body_camera->q * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(1, 0, 0), 1e-12));
  // Roll alone: the image's right edge goes down where the vehicle leans to the right.
  const CameraFile rolled = parse(good + "mount: {roll_deg: 20}\n");
  EXPECT_NEAR((rolled.T_body_camera->q * Eigen::Vector3d(1, 0, 0)).z(), -std::sin(20.0 * M_PI / 180.0),
              1e-12);
  EXPECT_TRUE((rolled.T_body_camera->q * Eigen::Vector3d(0, 0, 1)).isApprox(Eigen::Vector3d(1, 0, 0), 1e-12));
  expect_parts(complaint_of(good + "mount: {x: 1}\n"), {"calib.yaml:", "unknown key 'x' in 'mount'", "x_m"});
  expect_parts(complaint_of(good + "mount: 3\n"), {"{x_m, y_m"});
  expect_parts(complaint_of(good + "mount: {z_m: 1100}\n"), {"mount.z_m", "100"});
  expect_parts(complaint_of(good + "mount: {yaw_deg: north}\n"), {"finite number", "'north'"});
  expect_parts(complaint_of(good + "mount: {}\nT_body_camera: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n"),
               {"both"});
}

TEST(CameraMount, ACameraThatLooksAtTheSkyIsNoted) {
  const std::string good = ros("plumb_bob", "0, 0, 0, 0, 0", 5);
  const CameraFile sky = parse(good + "T_body_camera: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n");
  ASSERT_EQ(sky.notices.size(), 1U);
  expect_parts(sky.notices[0], {"90 degrees above the horizon"});
  EXPECT_EQ(parse(good + "mount: {pitch_deg: -60}\n").notices.size(), 1U);
  EXPECT_TRUE(parse(good + "mount: {pitch_deg: 90}\n").notices.empty()) << "downwards, as a drone's";
  EXPECT_TRUE(parse(good + "mount: {pitch_deg: -30}\n").notices.empty());
}

TEST(CameraFile, AnImageOfFourDegreesIsRefusedAndANarrowOneNoted) {
  const auto camera = [](const std::string& f) {
    return "model: pinhole-radtan\nwidth_px: 640\nheight_px: 480\nfx_px: " + f + "\nfy_px: " + f +
           "\ncx_px: 320\ncy_px: 240\ndistortion: []\n";
  };
  expect_parts(complaint_of(camera("9000")), {"calib.yaml", "4.1 degrees wide", "at least 5"});
  const CameraFile narrow = parse(camera("2500"));
  ASSERT_EQ(narrow.notices.size(), 1U);
  expect_parts(narrow.notices[0], {"14.6 degrees wide"});
  EXPECT_TRUE(parse(camera("600")).notices.empty());
}

}  // namespace
}  // namespace farpoint::daemon
