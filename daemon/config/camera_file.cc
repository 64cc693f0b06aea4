// SPDX-License-Identifier: Apache-2.0
#include "daemon/config/camera_file.h"

#include "daemon/config/calibration_message.h"
#include "daemon/config/errors.h"
#include "daemon/config/yaml_file.h"

namespace farpoint::daemon {
namespace {

constexpr double kMaxRowTime_s = 1e-3;  // 1 ms a row is half a second an image: certainly another unit

slam::CameraModel read_model(const YamlFile& yaml) {
  const std::string model = yaml.text("model");
  if (model == "pinhole-radtan") return slam::CameraModel::kPinholeRadtan;
  if (model == "kannala-brandt") return slam::CameraModel::kKannalaBrandt;
  yaml.fail(yaml.require("model"),
            "expected model 'pinhole-radtan' or 'kannala-brandt', found '" + model + "'");
}

CameraFile read_camera(const YamlFile& yaml) {
  yaml.allow_only({"model", "width_px", "height_px", "fx_px", "fy_px", "cx_px", "cy_px", "distortion",
                   "T_body_camera", "rate_hz", "row_time_s"});
  CameraFile camera;
  slam::Camera::Parameters& p = camera.parameters;
  p.model = read_model(yaml);
  p.width_px = yaml.integer("width_px");
  p.height_px = yaml.integer("height_px");
  p.fx_px = yaml.number("fx_px");
  p.fy_px = yaml.number("fy_px");
  p.cx_px = yaml.number("cx_px");
  p.cy_px = yaml.number("cy_px");
  const bool radtan = p.model == slam::CameraModel::kPinholeRadtan;
  const std::vector<double> distortion =
      yaml.numbers("distortion", radtan ? std::vector<std::size_t>{0, 4, 5} : std::vector<std::size_t>{4});
  std::copy(distortion.begin(), distortion.end(), p.distortion.begin());
  const std::string complaint = slam::Camera::check(p);
  if (!complaint.empty()) throw InputError(yaml.path().string() + ": " + complaint);

  if (yaml.has("T_body_camera")) {
    camera.T_body_camera = yaml.rigid_motion(yaml.require("T_body_camera"), "T_body_camera");
  }
  camera.rate_hz = yaml.number_or("rate_hz", 0.0);
  if (camera.rate_hz < 0.0) yaml.fail(yaml.require("rate_hz"), "expected rate_hz >= 0 (0: unknown)");
  camera.row_time_s = yaml.number_or("row_time_s", -1.0);
  if (camera.row_time_s > kMaxRowTime_s) {
    yaml.fail(yaml.require("row_time_s"),
              "expected row_time_s in seconds, at most 0.001 (0: global, negative: unknown)");
  }
  return camera;
}

}  // namespace

CameraFile read_camera_file(const std::filesystem::path& file) {
  return read_camera(YamlFile(file));
}

CameraFile parse_camera_file(const std::string& content, const std::filesystem::path& file) {
  return read_camera(YamlFile(file, content));
}

calibration_t calibration_of(const CameraFile& camera, const std::string& name) {
  calibration_t message{};
  message.body_name = camera.T_body_camera ? "body" : "";
  message.ncameras = 1;
  const slam::SE3 forward{slam::q_body_forward_camera(), Eigen::Vector3d::Zero()};
  message.cameras = {camera_message(name, camera.parameters, camera.T_body_camera.value_or(forward),
                                    camera.rate_hz, camera.row_time_s)};
  message.imu_orientation[0] = 1.0;
  return message;
}

calibration_t read_stereo_calibration(const std::filesystem::path& first,
                                      const std::filesystem::path& second) {
  const CameraFile cameras[] = {read_camera_file(first), read_camera_file(second)};
  const std::filesystem::path* const files[] = {&first, &second};
  for (int i = 0; i < 2; ++i) {
    if (cameras[i].T_body_camera) continue;
    throw InputError(
        files[i]->string() +
        ": no T_body_camera, expected it in the files of both cameras of a stereo pair, to place them "
        "on one body");
  }
  calibration_t message = calibration_of(cameras[0], "left");
  const CameraFile& other = cameras[1];
  message.cameras.push_back(
      camera_message("right", other.parameters, *other.T_body_camera, other.rate_hz, other.row_time_s));
  message.ncameras = 2;
  return message;
}

}  // namespace farpoint::daemon
