// SPDX-License-Identifier: Apache-2.0
// Importers: what they find in recordings of each layout, and what they say about malformed ones.
// Long file: the layouts share the recordings that are made here, and their lists of damages.
#include <gtest/gtest.h>

#include <functional>

#include "daemon/config/camera_file.h"
#include "ipc/log.h"
#include "tests/support/paths.h"
#include "tests/tools/tool_support.h"
#include "tools/common/errors.h"
#include "tools/import/euroc.h"
#include "tools/import/kitti.h"
#include "tools/import/recording_log.h"
#include "tools/import/tum.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

// One way to spoil a recording, and what the complaint must name.
struct Damage {
  std::string name;
  std::function<void(const fs::path& root)> spoil;
  std::vector<std::string> complaint;
};
// NOLINTNEXTLINE(readability-identifier-naming): GoogleTest's name
void PrintTo(const Damage& damage, std::ostream* out) {
  *out << damage.name;
}

auto replacing(const std::string& file, const std::string& from, const std::string& to) {
  return [=](const fs::path& root) { replace_in(root / file, from, to); };
}
auto removing(const std::string& file) {
  return [=](const fs::path& root) { fs::remove_all(root / file); };
}
auto writing(const std::string& file, const std::string& content) {
  return [=](const fs::path& root) { put(root / file, content); };
}
std::string name_of(const testing::TestParamInfo<Damage>& info) {
  return info.param.name;
}

// ---- parts ----

TEST(ImportPart, KeepsTheFramesAskedForAndTheTruthAroundThem) {
  const ScratchFolder root;
  make_kitti(root.path());
  const Recording whole = read_kitti(root.path(), "07");
  Recording part = whole;
  keep_part(1, 2, "07", &part);
  ASSERT_EQ(part.images.size(), 4U);  // two instants of two cameras
  EXPECT_EQ(part.images.front().utime, whole.images[2].utime);
  EXPECT_EQ(part.images.front().sequence, 1);  // numbered as in the whole recording
  EXPECT_EQ(part.images.back().utime, whole.images[5].utime);
  EXPECT_EQ(part.truth.size(), whole.truth.size()) << "0.5 s of truth stay on either side";

  Recording rest = whole;
  keep_part(3, 0, "07", &rest);
  EXPECT_EQ(rest.images.size(), 4U);
  Recording beyond = whole;
  keep_part(4, 100, "07", &beyond);
  EXPECT_EQ(beyond.images.size(), 2U);
}

TEST(ImportPart, SaysWhatAPartMayBe) {
  const ScratchFolder root;
  make_kitti(root.path());
  Recording recording = read_kitti(root.path(), "07");
  for (const auto& [first, frames] : {std::pair{5, 0}, {-1, 0}, {0, -2}}) {
    expect_all_in(
        complaint_of([&, first = first, frames = frames] { keep_part(first, frames, "07", &recording); }),
        {"07", "--first", "5 frames, 0 to 4"});
  }
  const ProgramResult r = run_farpoint_program("import kitti '" + root.path().string() +
                                               "' 07 --first 9 -o '" + (root / "x.lcm").string() + "'");
  EXPECT_EQ(r.status, 2);
  EXPECT_FALSE(fs::exists(root / "x.lcm"));
}

// ---- KITTI ----

TEST(ImportKitti, ReadsStereoTimesAndPoses) {
  const ScratchFolder root;
  make_kitti(root.path());
  const Recording r = read_kitti(root.path(), "07");
  EXPECT_EQ(r.body_name, "");
  ASSERT_EQ(r.cameras.size(), 2U);
  EXPECT_EQ(r.cameras[0].parameters.width_px, 64);
  EXPECT_EQ(r.cameras[0].parameters.height_px, 48);
  EXPECT_EQ(r.cameras[1].parameters.fy_px, 51.0);
  EXPECT_NEAR(r.cameras[0].rate_hz, 10.0, 1e-9);
  // The camera looks along body x; the right camera stands 25/50 m to the right, which is -y.
  EXPECT_TRUE((r.cameras[0].T_body_camera * Eigen::Vector3d(0, 0, 1)).isApprox(Eigen::Vector3d(1, 0, 0)));
  EXPECT_TRUE((r.cameras[0].T_body_camera * Eigen::Vector3d(0, 1, 0)).isApprox(Eigen::Vector3d(0, 0, -1)));
  EXPECT_TRUE(r.cameras[1].T_body_camera.t.isApprox(Eigen::Vector3d(0, -0.5, 0)));
  ASSERT_EQ(r.images.size(), 10U);
  EXPECT_EQ(r.images[2].utime, 125'000);
  EXPECT_EQ(r.images[2].sequence, 1);
  EXPECT_EQ(r.images[3].camera, 1);
  EXPECT_EQ(r.missing_images, 0U);
}

TEST(ImportKitti, TruthKeepsPositionsAndTurnsAxesIntoTheBodys) {
  const ScratchFolder root;
  make_kitti(root.path());
  const Recording r = read_kitti(root.path(), "07");
  ASSERT_EQ(r.truth.size(), 5U);
  EXPECT_TRUE(r.truth_has_orientation);
  EXPECT_TRUE(r.truth[3].T_world_body.t.isApprox(Eigen::Vector3d(0, 0, 1.5)));
  // The body's x axis is the camera's optical axis, world z here; its z axis points up, which is world -y.
  EXPECT_TRUE((r.truth[3].T_world_body.q * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(0, 0, 1)));
  EXPECT_TRUE((r.truth[3].T_world_body.q * Eigen::Vector3d(0, 0, 1)).isApprox(Eigen::Vector3d(0, -1, 0)));
  EXPECT_TRUE((r.truth[4].T_world_body.q * Eigen::Vector3d(0, 0, 1)).isApprox(Eigen::Vector3d(0, 1, 0)));
}

TEST(ImportKitti, WithoutTimesFramesAreATenthOfASecondApart) {
  const ScratchFolder root;
  make_kitti(root.path());
  fs::remove(root / "sequences/07/times.txt");
  const Recording r = read_kitti(root.path(), "07");
  EXPECT_EQ(r.images.front().utime, 0);
  EXPECT_EQ(r.images.back().utime, 400'000);
}

TEST(ImportKitti, GpsIsTruthOfPositionOnly) {
  const ScratchFolder root;
  make_kitti(root.path());
  fs::remove(root / "poses/07.txt");
  put(root / "sequences/07/gps_xy.txt", "# seconds east north\n0.025 1 2\n0.125 1.5 2.5\n");
  const Recording r = read_kitti(root.path(), "07");
  EXPECT_FALSE(r.truth_has_orientation);
  ASSERT_EQ(r.truth.size(), 2U);
  EXPECT_EQ(r.truth[1].utime, 125'000);
  EXPECT_EQ(r.truth[1].T_world_body.t, Eigen::Vector3d(1.5, 2.5, 0.0));
}

TEST(ImportKitti, WheelsBesideTheTimesBecomeSamples) {
  const ScratchFolder root;
  make_kitti(root.path());
  EXPECT_TRUE(read_kitti(root.path(), "07").wheels.empty());
  put(root / "sequences/07/wheels.csv",
      "#seconds,speed_mps,yaw_rate_rad_per_s\n0.05,4.5,-0.25\n0.09,4.75,0.125\n");
  const Recording r = read_kitti(root.path(), "07");
  ASSERT_EQ(r.wheels.size(), 2U);
  EXPECT_EQ(r.wheels[1].utime, 90'000);
  EXPECT_EQ(r.wheels[1].speed_mps, 4.75);
  EXPECT_EQ(r.wheels[0].yaw_rate_radps, -0.25);
}

TEST(ImportKitti, DamagedWheelsAreNamed) {
  const ScratchFolder root;
  make_kitti(root.path());
  const auto complaint = [&] {
    return complaint_of([&] { (void)read_kitti(root.path(), "07", Damaged::kRefused); });
  };
  put(root / "sequences/07/wheels.csv", "0.05,4.5\n");
  expect_all_in(complaint(), {"wheels.csv:1:", "seconds,speed_mps,yaw_rate_rad_per_s"});
  put(root / "sequences/07/wheels.csv", "0.05,4.5,0\n0.05,4.5,0\n");
  expect_all_in(complaint(), {"wheels.csv:2:", "after the one above"});
  put(root / "sequences/07/wheels.csv", "0.05,fast,0\n");
  expect_all_in(complaint(), {"wheels.csv:1:", "'fast'"});
  EXPECT_TRUE(read_kitti(root.path(), "07").wheels.empty()) << "imported without this sensor";
}

TEST(ImportKitti, MonocularWithoutTruthAndMissingImages) {
  const ScratchFolder root;
  make_kitti(root.path());
  fs::remove_all(root / "sequences/07/image_1");
  fs::remove(root / "poses/07.txt");
  fs::remove(root / "sequences/07/image_0/000002.png");
  const Recording r = read_kitti(root.path(), "07");
  EXPECT_EQ(r.cameras.size(), 1U);
  EXPECT_EQ(r.images.size(), 4U);
  EXPECT_EQ(r.images[2].sequence, 3);
  EXPECT_EQ(r.images[2].utime, 325'000);
  EXPECT_EQ(r.missing_images, 1U);
  EXPECT_TRUE(r.truth.empty());
}

class KittiDamage : public testing::TestWithParam<Damage> {};

TEST_P(KittiDamage, IsNamed) {
  const ScratchFolder root;
  make_kitti(root.path());
  GetParam().spoil(root.path());
  expect_all_in(complaint_of([&] { (void)read_kitti(root.path(), "07", Damaged::kRefused); }),
                GetParam().complaint);
}

INSTANTIATE_TEST_SUITE_P(
    Import, KittiDamage,
    testing::Values(
        Damage{"NoSequence", removing("sequences/07"), {"sequences/07", "no such folder"}},
        Damage{"NoImages", removing("sequences/07/image_0"), {"image_0", "no such folder"}},
        Damage{"NoCalibration", removing("sequences/07/calib.txt"), {"calib.txt", "cannot be opened"}},
        Damage{"NoP0", replacing("sequences/07/calib.txt", "P0:", "P9:"), {"calib.txt", "'P0:' is missing"}},
        Damage{"NoP1",
               replacing("sequences/07/calib.txt", "P1:", "P9:"),
               {"calib.txt", "'P1:' is missing", "image_1"}},
        Damage{"ShortP1",
               replacing("sequences/07/calib.txt", "-25 ", ""),
               {"calib.txt:2:", "expected 13 fields"}},
        Damage{"WordInP0",
               replacing("sequences/07/calib.txt", "31.5", "abc"),
               {"calib.txt:1:", "finite number", "'abc'"}},
        Damage{
            "NanInP0", replacing("sequences/07/calib.txt", "31.5", "nan"), {"calib.txt:1:", "finite number"}},
        Damage{"NotRectified",
               replacing("sequences/07/calib.txt", "0 0 1 0", "0 0.1 1 0"),
               {"calib.txt:1:", "rectified"}},
        Damage{"PrincipalPointOutside",
               replacing("sequences/07/calib.txt", "31.5", "3150"),
               {"calib.txt", "image_0"}},
        Damage{"TimeNotANumber",
               replacing("sequences/07/times.txt", "0.225", "soon"),
               {"times.txt:3:", "'soon'"}},
        Damage{"TimeBackwards",
               replacing("sequences/07/times.txt", "0.225", "0.1"),
               {"times.txt:3:", "after the one above"}},
        Damage{
            "TimeNegative", replacing("sequences/07/times.txt", "0.025", "-1"), {"times.txt:1:", "0 to 9e9"}},
        Damage{
            "TooFewTimes", writing("sequences/07/times.txt", "0\n1\n"), {"times.txt: 2 times", "at least 5"}},
        Damage{"ShortPose",
               writing("poses/07.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 2 3\n"),
               {"07.txt:2:", "expected 12 fields"}},
        Damage{"PoseNotARotation",
               writing("poses/07.txt", "1 0 0 0 0 2 0 0 0 0 1 0\n"),
               {"07.txt:1:", "rotation"}},
        Damage{"ImageNotNumbered",
               writing("sequences/07/image_0/first.png", "x"),
               {"first.png", "named by its number"}},
        Damage{"ImageTwice", writing("sequences/07/image_0/000001.jpg", "x"), {"000001", "second image"}},
        Damage{"NotAnImage",
               writing("sequences/07/image_0/000000.png", "hello"),
               {"000000.png", "PNG or JPEG"}}),
    name_of);

TEST(ImportKitti, DamagedGpsIsNamed) {
  const ScratchFolder root;
  make_kitti(root.path());
  fs::remove(root / "poses/07.txt");
  put(root / "sequences/07/gps_xy.txt", "0 1 2\n0.1 1\n");
  expect_all_in(complaint_of([&] { (void)read_kitti(root.path(), "07", Damaged::kRefused); }),
                {"gps_xy.txt:2:", "seconds east north"});
  put(root / "sequences/07/gps_xy.txt", "0 1 2\n0 1 2\n");
  expect_all_in(complaint_of([&] { (void)read_kitti(root.path(), "07", Damaged::kRefused); }),
                {"gps_xy.txt:2:", "after the one above"});
}

// ---- EuRoC ----

TEST(ImportEuroc, ReadsCamerasImuAndTruth) {
  const ScratchFolder root;
  make_euroc(root.path());
  for (const fs::path& given : {root.path(), root / "mav0"}) {
    const Recording r = read_euroc(given);
    EXPECT_FALSE(r.body_name.empty());
    ASSERT_EQ(r.cameras.size(), 2U);
    EXPECT_EQ(r.cameras[0].parameters.model, slam::CameraModel::kPinholeRadtan);
    EXPECT_EQ(r.cameras[0].parameters.distortion[1], 0.07);
    EXPECT_EQ(r.cameras[0].rate_hz, 20.0);
    EXPECT_TRUE(
        (r.cameras[0].T_body_camera * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(0.1, 1.2, 0.3)));
    EXPECT_EQ(r.images.size(), 9U);
    EXPECT_EQ(r.missing_images, 1U);
    EXPECT_EQ(r.images[0].utime, 1403636579763556);  // ...763555584 ns, rounded
    EXPECT_EQ(r.images[4].sequence, 2);
    EXPECT_EQ(r.images[5].sequence, 3);  // the third pair has no right image
    ASSERT_EQ(r.imu.size(), 5U);
    EXPECT_EQ(r.imu[0].acceleration_mps2, Eigen::Vector3d(9.8, 0.5, -0.5));
    ASSERT_TRUE(r.imu_calibration.has_value());
    EXPECT_EQ(r.imu_calibration->gyro_noise_density, 1.7e-4);
    EXPECT_EQ(r.imu_calibration->accel_random_walk, 3.0e-3);
    ASSERT_EQ(r.truth.size(), 5U);
    EXPECT_EQ(r.truth[4].T_world_body.t, Eigen::Vector3d(4, 2, 3));
    EXPECT_NEAR(r.truth[4].T_world_body.q.x(), 0.8, 1e-12);  // w comes first in the file
  }
}

TEST(ImportEuroc, EquidistantMonocularAndImageMissingOnTheLeft) {
  const ScratchFolder root;
  make_euroc(root.path());
  fs::remove(root / "mav0/cam0/data/1403636579763555584.png");
  EXPECT_EQ(read_euroc(root.path()).missing_images, 2U);
  fs::remove_all(root / "mav0/cam1");
  fs::remove_all(root / "mav0/imu0");
  fs::remove_all(root / "mav0/state_groundtruth_estimate0");
  replace_in(root / "mav0/cam0/sensor.yaml", "radial-tangential", "equidistant");
  const Recording r = read_euroc(root.path());
  EXPECT_EQ(r.cameras.size(), 1U);
  EXPECT_EQ(r.cameras[0].parameters.model, slam::CameraModel::kKannalaBrandt);
  EXPECT_EQ(r.images.size(), 4U);
  EXPECT_EQ(r.missing_images, 1U);
  EXPECT_FALSE(r.imu_calibration.has_value());
  EXPECT_TRUE(r.truth.empty());
}

class EurocDamage : public testing::TestWithParam<Damage> {};

TEST_P(EurocDamage, IsNamed) {
  const ScratchFolder root;
  make_euroc(root.path());
  GetParam().spoil(root.path());
  expect_all_in(complaint_of([&] { (void)read_euroc(root.path(), Damaged::kRefused); }),
                GetParam().complaint);
}

INSTANTIATE_TEST_SUITE_P(
    Import, EurocDamage,
    testing::Values(
        Damage{"NoCamera", removing("mav0/cam0"), {"mav0/cam0", "expected an EuRoC recording"}},
        Damage{"NoList", removing("mav0/cam0/data.csv"), {"cam0/data.csv", "cannot be opened"}},
        Damage{"NoImages", removing("mav0/cam0/data"), {"cam0/data.csv", "none of its images"}},
        Damage{"NoSensorFile", removing("mav0/cam0/sensor.yaml"), {"cam0/sensor.yaml", "cannot be opened"}},
        Damage{"NotYaml",
               writing("mav0/cam0/sensor.yaml", "a: b\nc: [1, 2\n"),
               {"sensor.yaml:", "not valid YAML"}},
        Damage{"NoExtrinsics",
               replacing("mav0/cam0/sensor.yaml", "T_BS:", "T_XX:"),
               {"cam0/sensor.yaml", "'T_BS' is missing"}},
        Damage{"ShortExtrinsics",
               replacing("mav0/cam0/sensor.yaml", "0.0, -1.0, 0.0, 0.1,", "0.0, -1.0, 0.0,"),
               {"cam0/sensor.yaml:5:", "16 numbers"}},
        Damage{"ExtrinsicsNotRigid",
               replacing("mav0/cam0/sensor.yaml", "-1.0", "-1.5"),
               {"cam0/sensor.yaml:5:", "rigid motion"}},
        Damage{"UnknownDistortion",
               replacing("mav0/cam1/sensor.yaml", "radial-tangential", "fov"),
               {"cam1/sensor.yaml:13:", "'fov'", "equidistant"}},
        Damage{"UnknownModel",
               replacing("mav0/cam0/sensor.yaml", "pinhole", "omni"),
               {"cam0/sensor.yaml:11:", "pinhole"}},
        Damage{"ThreeIntrinsics",
               replacing("mav0/cam0/sensor.yaml", "[50, 51, 31.5, 23.5]", "[50, 51, 31.5]"),
               {"cam0/sensor.yaml:12:", "4 numbers", "found 3"}},
        Damage{"IntrinsicsNotNumbers",
               replacing("mav0/cam0/sensor.yaml", "51", "wide"),
               {"cam0/sensor.yaml:12:", "'wide'"}},
        Damage{"FocalLengthNegative",
               replacing("mav0/cam0/sensor.yaml", "[50", "[-50"),
               {"cam0/sensor.yaml", "cam0"}},
        Damage{"ImageLineWithoutName",
               replacing("mav0/cam0/data.csv", "1403636579763556584,1403636579763556584.png",
                         "1403636579763556584"),
               {"cam0/data.csv:3:", "expected 2 fields"}},
        Damage{"ImageTimeBackwards",
               replacing("mav0/cam0/data.csv", "1403636579763556584,", "1403636579763554584,"),
               {"cam0/data.csv:3:", "after the one above"}},
        Damage{"ImageTimeNotInteger",
               replacing("mav0/cam0/data.csv", "1403636579763556584,", "1.4e18,"),
               {"cam0/data.csv:3:", "integer"}},
        Damage{"ImuShort",
               replacing("mav0/imu0/data.csv", ",-0.5", ""),
               {"imu0/data.csv:2:", "expected 7 fields"}},
        Damage{"ImuNan", replacing("mav0/imu0/data.csv", "9.8", "nan"), {"imu0/data.csv:2:", "acceleration"}},
        Damage{"ImuTimeTwice",
               replacing("mav0/imu0/data.csv", "1403636579763556584", "1403636579763555584"),
               {"imu0/data.csv:3:", "after the one above"}},
        Damage{"TruthQuaternion",
               replacing("mav0/state_groundtruth_estimate0/data.csv", "0.6,0.8", "0.6,0.9"),
               {"state_groundtruth_estimate0/data.csv:2:", "unit quaternion"}},
        Damage{"TruthShort",
               writing("mav0/state_groundtruth_estimate0/data.csv", "1,2,3\n"),
               {"state_groundtruth_estimate0/data.csv:1:", "expected 8 fields"}}),
    name_of);

// ---- TUM ----

TEST(ImportTum, ReadsImagesAndTruthOfTheBody) {
  const ScratchFolder root;
  make_tum(root.path());
  const Recording r = read_tum_rgbd(root.path(), root / "camera.yaml");
  EXPECT_EQ(r.body_name, "");
  ASSERT_EQ(r.images.size(), 5U);
  EXPECT_EQ(r.images[1].utime, 1305031229561748);
  ASSERT_EQ(r.truth.size(), 5U);
  EXPECT_EQ(r.truth[2].utime, 1305031229594748);
  EXPECT_TRUE(r.truth[2].T_world_body.t.isApprox(Eigen::Vector3d(1, 2, 2)));
  // The body's x axis is where the camera's z axis points.
  const Eigen::Quaterniond q_world_camera(0.8, 0.6, 0.0, 0.0);
  EXPECT_TRUE((r.truth[2].T_world_body.q * Eigen::Vector3d(1, 0, 0))
                  .isApprox(q_world_camera * Eigen::Vector3d(0, 0, 1)));
}

TEST(ImportTum, BodyFromTheCameraFileAndMissingImages) {
  const ScratchFolder root;
  make_tum(root.path());
  put(root / "camera.yaml",
      get(root / "camera.yaml") + "T_body_camera: [1,0,0,0.5, 0,1,0,0, 0,0,1,0, 0,0,0,1]\nrate_hz: 30\n");
  fs::remove(root / "rgb/1305031229.561748.jpg");
  const Recording r = read_tum_rgbd(root.path(), root / "camera.yaml");
  EXPECT_FALSE(r.body_name.empty());
  EXPECT_EQ(r.missing_images, 1U);
  EXPECT_EQ(r.images[1].sequence, 2);
  EXPECT_EQ(r.cameras[0].rate_hz, 30.0);
  EXPECT_TRUE(
      r.truth[0].T_world_body.t.isApprox(Eigen::Vector3d(0.5, 2, 0)));  // the axis of its rotation is x
}

class TumDamage : public testing::TestWithParam<Damage> {};

TEST_P(TumDamage, IsNamed) {
  const ScratchFolder root;
  make_tum(root.path());
  GetParam().spoil(root.path());
  expect_all_in(
      complaint_of([&] { (void)read_tum_rgbd(root.path(), root / "camera.yaml", Damaged::kRefused); }),
      GetParam().complaint);
}

INSTANTIATE_TEST_SUITE_P(
    Import, TumDamage,
    testing::Values(Damage{"NoList", removing("rgb.txt"), {"rgb.txt", "cannot be opened"}},
                    Damage{"NoImages", removing("rgb"), {"rgb.txt", "no image that exists"}},
                    Damage{"LineWithoutName",
                           replacing("rgb.txt", " rgb/1305031229.561748.jpg", ""),
                           {"rgb.txt:3:", "expected 2 fields"}},
                    Damage{"TimeNotANumber",
                           replacing("rgb.txt", "1305031229.561748 ", "noon "),
                           {"rgb.txt:3:", "'noon'"}},
                    Damage{"TimeTwice",
                           replacing("rgb.txt", "1305031229.561748 ", "1305031229.528748 "),
                           {"rgb.txt:3:", "after the one above"}},
                    Damage{"TruthShort",
                           replacing("groundtruth.txt", " 0.6 0 0 0.8", ""),
                           {"groundtruth.txt:2:", "expected 8 fields"}},
                    Damage{"TruthQuaternion",
                           replacing("groundtruth.txt", "0.6", "0.9"),
                           {"groundtruth.txt:2:", "unit quaternion"}},
                    Damage{"NoCameraFile", removing("camera.yaml"), {"camera.yaml", "cannot be opened"}}),
    name_of);

// ---- sensors beside the images ----

// One notice that holds the parts.
void expect_left_out(const Recording& recording, const std::vector<std::string>& parts) {
  ASSERT_EQ(recording.notices.size(), 1U);
  expect_all_in(recording.notices[0], parts);
  expect_all_in(recording.notices[0], {"imported without this sensor"});
}

TEST(ImportDamagedSensor, KittiIsImportedWithoutItsTruth) {
  const ScratchFolder root;
  make_kitti(root.path());
  put(root / "poses/07.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 2 3\n");
  const Recording poses = read_kitti(root.path(), "07");
  EXPECT_EQ(poses.images.size(), 10U);
  EXPECT_TRUE(poses.truth.empty());
  expect_left_out(poses, {"07.txt:2:", "expected 12 fields"});
  fs::remove(root / "poses/07.txt");
  put(root / "sequences/07/gps_xy.txt", "0 1 2\n0.1 1\n");
  expect_left_out(read_kitti(root.path(), "07"), {"gps_xy.txt:2:"});
}

TEST(ImportDamagedSensor, EurocIsImportedWithoutItsImuOrTruth) {
  const ScratchFolder root;
  make_euroc(root.path());
  replace_in(root / "mav0/imu0/data.csv", "9.8", "nan");
  const Recording imu = read_euroc(root.path());
  EXPECT_EQ(imu.images.size(), 9U);
  EXPECT_TRUE(imu.imu.empty());
  EXPECT_FALSE(imu.imu_calibration.has_value()) << "a calibration without samples";
  EXPECT_EQ(imu.truth.size(), 5U);
  expect_left_out(imu, {"imu0/data.csv:2:", "acceleration"});
  fs::remove_all(root / "mav0/imu0");
  put(root / "mav0/state_groundtruth_estimate0/data.csv", "1,2,3\n");
  expect_left_out(read_euroc(root.path()), {"state_groundtruth_estimate0/data.csv:1:"});
}

TEST(ImportDamagedSensor, TumIsImportedWithoutItsTruth) {
  const ScratchFolder root;
  make_tum(root.path());
  replace_in(root / "groundtruth.txt", " 0.6 0 0 0.8", "");
  const Recording r = read_tum_rgbd(root.path(), root / "camera.yaml");
  EXPECT_EQ(r.images.size(), 5U);
  EXPECT_TRUE(r.truth.empty());
  expect_left_out(r, {"groundtruth.txt:2:"});
}

TEST(ImportDamagedSensor, TheProgramWarnsAndStrictRefuses) {
  const ScratchFolder root;
  make_euroc(root.path());
  replace_in(root / "mav0/imu0/data.csv", "9.8", "nan");
  const std::string command =
      "import euroc '" + root.path().string() + "' -o '" + (root / "x.lcm").string() + "'";
  const ProgramResult strict = run_farpoint_program(command + " --strict");
  EXPECT_EQ(strict.status, 2);
  EXPECT_FALSE(fs::exists(root / "x.lcm"));
  const ProgramResult done = run_farpoint_program(command);
  EXPECT_EQ(done.status, 0);
  EXPECT_NE(done.err.find("imu0/data.csv:2:"), std::string::npos) << done.err;
  EXPECT_NE(done.out.find("0 IMU samples, 5 truth poses"), std::string::npos) << done.out;
}

// ---- stamps ----

TEST(ImportStamps, DatesInNanosecondsAreUnderstoodWhereSecondsAreUsual) {
  const ScratchFolder root;
  make_tum(root.path());
  std::string list, truth;
  for (int i = 0; i < 5; ++i) {
    list += std::to_string(1305031229528748501 + 33'000'000LL * i) + " rgb/1305031229." +
            std::to_string(528748 + 33000 * i) + ".jpg\n";
    truth += std::to_string(1305031229528748499 + 33'000'000LL * i) + " 1 2 3 0 0 0 1\n";
  }
  put(root / "rgb.txt", list);
  put(root / "groundtruth.txt", truth);
  const Recording r = read_tum_rgbd(root.path(), root / "camera.yaml");
  ASSERT_EQ(r.images.size(), 5U);
  EXPECT_EQ(r.images[1].utime, 1305031229561749) << "rounded to the nearest";
  EXPECT_EQ(r.truth.at(1).utime, 1305031229561748);
  replace_in(root / "rgb.txt", "1305031229528748501", "13050312295287");
  expect_all_in(complaint_of([&] { (void)read_tum_rgbd(root.path(), root / "camera.yaml"); }),
                {"rgb.txt:1:", "0 to 9e9 seconds"});
}

// ---- camera files ----

TEST(CameraFile, ShippedOnesAreGood) {
  int files = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(test::source_dir()) / "config/cameras")) {
    if (entry.path().extension() != ".yaml") continue;
    ++files;
    const daemon::CameraFile camera = daemon::read_camera_file(entry.path());
    EXPECT_EQ(slam::Camera::check(camera.parameters), "") << entry.path();
  }
  EXPECT_GE(files, 3);
}

TEST(CameraFile, ReadsEveryKey) {
  const ScratchFolder root;
  put(root / "c.yaml",
      "model: kannala-brandt\nwidth_px: 640\nheight_px: 480\nfx_px: 300\nfy_px: 301\ncx_px: 320\ncy_px: 240\n"
      "distortion: [0.01, 0.02, 0.003, 0.004]\nT_body_camera: [0,0,1,1, -1,0,0,2, 0,-1,0,3, "
      "0,0,0,1]\nrate_hz: 15\n"
      "row_time_s: 3e-5\n");
  const daemon::CameraFile c = daemon::read_camera_file(root / "c.yaml");
  EXPECT_EQ(c.parameters.model, slam::CameraModel::kKannalaBrandt);
  EXPECT_EQ(c.parameters.fy_px, 301.0);
  EXPECT_EQ(c.parameters.distortion[3], 0.004);
  ASSERT_TRUE(c.T_body_camera.has_value());
  EXPECT_TRUE((*c.T_body_camera * Eigen::Vector3d(0, 0, 1)).isApprox(Eigen::Vector3d(2, 2, 3)));
  EXPECT_EQ(c.rate_hz, 15.0);
  EXPECT_EQ(c.row_time_s, 3e-5);
}

class CameraFileDamage : public testing::TestWithParam<Damage> {};

TEST_P(CameraFileDamage, IsNamed) {
  const ScratchFolder root;
  make_tum(root.path());
  GetParam().spoil(root.path());
  expect_all_in(complaint_of([&] { (void)daemon::read_camera_file(root / "camera.yaml"); }),
                GetParam().complaint);
}

INSTANTIATE_TEST_SUITE_P(
    Import, CameraFileDamage,
    testing::Values(
        Damage{"UnknownKey",
               replacing("camera.yaml", "fx_px", "fx"),
               {"camera.yaml:4:", "unknown key 'fx'", "fx_px"}},
        Damage{
            "MissingKey", replacing("camera.yaml", "fx_px: 50\n", ""), {"camera.yaml", "'fx_px' is missing"}},
        Damage{"UnknownModel",
               replacing("camera.yaml", "pinhole-radtan", "fisheye"),
               {"camera.yaml:1:", "'fisheye'", "kannala-brandt"}},
        Damage{"SizeNotInteger",
               replacing("camera.yaml", "64", "64.5"),
               {"camera.yaml:2:", "integer", "width_px"}},
        Damage{"NotANumber", replacing("camera.yaml", "31.5", "centre"), {"camera.yaml:6:", "'centre'"}},
        Damage{"ThreeCoefficients",
               replacing("camera.yaml", ", 0.002, 1.1", ""),
               {"camera.yaml:8:", "4 or 5", "found 3"}},
        Damage{"NegativeFocalLength", replacing("camera.yaml", "fx_px: 50", "fx_px: -50"), {"camera.yaml"}},
        Damage{"RowTimeInMicroseconds",
               writing("camera.yaml",
                       "model: pinhole-radtan\nwidth_px: 64\nheight_px: 48\nfx_px: 50\nfy_px: 51\n"
                       "cx_px: 31.5\ncy_px: 23.5\ndistortion: []\nrow_time_s: 30\n"),
               {"camera.yaml:9:", "row_time_s", "seconds"}},
        Damage{"NotAMap", writing("camera.yaml", "- 1\n- 2\n"), {"camera.yaml:1:", "key: value"}}),
    name_of);

// ---- the log ----

struct LoggedEvent {
  std::string channel;
  std::vector<std::uint8_t> data;
};

std::vector<LoggedEvent> read_log(const fs::path& file) {
  ipc::LogReader reader(file.string());
  std::vector<LoggedEvent> events;
  for (ipc::LogEvent event; reader.next(&event);) {
    events.push_back({std::string(event.channel), {event.data.begin(), event.data.end()}});
  }
  EXPECT_EQ(reader.damage().places, 0U);
  return events;
}

template <typename Message>
Message decoded(const LoggedEvent& event) {
  Message message;
  EXPECT_TRUE(ipc::decode(event.data, &message)) << event.channel;
  return message;
}

TEST(RecordingLog, CalibrationFirstThenMessagesInTheOrderOfTime) {
  const ScratchFolder root;
  make_euroc(root.path());
  write_recording(read_euroc(root.path()), root / "run.lcm");
  const std::vector<LoggedEvent> events = read_log(root / "run.lcm");
  ASSERT_EQ(events.size(), 1U + 5U + 5U + 9U);
  const auto calibration = decoded<calibration_t>(events[0]);
  EXPECT_EQ(calibration.cameras.size(), 2U);
  EXPECT_EQ(calibration.cameras[1].model, "pinhole-radtan");
  EXPECT_EQ(calibration.cameras[0].position[2], 0.3);
  EXPECT_NEAR(calibration.cameras[0].orientation[0], std::sqrt(0.5), 1e-12);  // 90 degrees about z, w first
  EXPECT_NEAR(calibration.cameras[0].orientation[3], std::sqrt(0.5), 1e-12);
  EXPECT_TRUE(calibration.has_imu);
  std::vector<std::string> channels;
  for (std::size_t i = 1; i <= 4; ++i) channels.push_back(events[i].channel);
  EXPECT_EQ(channels, (std::vector<std::string>{"IMU", "GROUND_TRUTH", "CAMERA_0", "CAMERA_1"}));
  EXPECT_EQ(decoded<imu_t>(events[5]).utime, 1403636579763557);
}

TEST(RecordingLog, ImageBytesPassThrough) {
  const ScratchFolder root;
  make_tum(root.path());
  write_recording(read_tum_rgbd(root.path(), root / "camera.yaml"), root / "run.lcm");
  int images = 0;
  for (const LoggedEvent& event : read_log(root / "run.lcm")) {
    if (event.channel != "CAMERA_0") continue;
    const auto image = decoded<image_t>(event);
    if (images++ != 1) continue;
    EXPECT_EQ(image.utime, 1305031229561748);
    EXPECT_EQ(image.sequence, 1);
    EXPECT_EQ(image.width, 64);
    EXPECT_EQ(image.pixel_format, image_t::PIXEL_FORMAT_MJPEG);
    EXPECT_EQ(std::string(image.data.begin(), image.data.end()), get(root / "rgb/1305031229.561748.jpg"));
  }
  EXPECT_EQ(images, 5);
}

TEST(RecordingLog, FailureLeavesTheOldFile) {
  const ScratchFolder root;
  make_kitti(root.path());
  put(root / "run.lcm", "old");
  put(root / "sequences/07/image_0/000003.png", make_image(".png", 32, 48, 0));
  const Recording recording = read_kitti(root.path(), "07");
  expect_all_in(complaint_of([&] { write_recording(recording, root / "run.lcm"); }),
                {"000003.png", "64x48", "32x48"});
  EXPECT_EQ(get(root / "run.lcm"), "old");
  EXPECT_EQ(std::distance(fs::directory_iterator(root.path()), {}), 3) << "something was left behind";
}

TEST(RecordingLog, SuccessReplacesTheOldFile) {
  const ScratchFolder root;
  make_kitti(root.path());
  put(root / "run.lcm", "old");
  write_recording(read_kitti(root.path(), "07"), root / "run.lcm");
  EXPECT_EQ(read_log(root / "run.lcm").size(), 1U + 5U + 10U);
}

}  // namespace
}  // namespace farpoint::tools
