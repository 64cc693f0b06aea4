// SPDX-License-Identifier: Apache-2.0
// Configuration, camera and world files.
#include <fstream>
#include <iterator>

#include "daemon/config/camera_file.h"
#include "daemon/config/config.h"
#include "daemon/config/errors.h"
#include "daemon/config/rig.h"
#include "daemon/config/yaml_file.h"
#include "ipc/printable.h"
#include "tests/fuzz/targets.h"
#include "tests/support/paths.h"
#include "tools/simulate/world/world_file.h"

namespace farpoint::fuzz {
namespace {

Bytes shipped(const std::string& path) {
  std::ifstream file(test::source_dir() + "/" + path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void check_config(const std::string& text) {
  daemon::Config config;
  daemon::ConfigOrigins origins;
  daemon::load_config_text(text, "f.yaml", &config, &origins);
  daemon::check_relations(config, origins);
  // What was accepted is written and read back the same.
  const std::string canonical = daemon::canonical_text(config);
  daemon::Config again;
  daemon::load_config_text(canonical, "canonical.yaml", &again, &origins);
  require(daemon::canonical_text(again) == canonical, "the canonical text of a configuration is read back");
}

// A setting of the command line: the first line.
void check_setting(const std::string& text) {
  daemon::Config config;
  daemon::ConfigOrigins origins;
  daemon::apply_setting(text.substr(0, text.find('\n')), &config, &origins);
  daemon::check_relations(config, origins);
}

template <typename Function>
void expect_one_line(Function&& function) {
  try {
    function();
  } catch (const daemon::ConfigError& error) {
    require(ipc::is_printable_line(error.what()), "an error is one line");
  } catch (const daemon::InputError& error) {
    require(ipc::is_printable_line(error.what()), "an error is one line");
  }
}

void check_camera(const std::string& text, const std::string& name) {
  const daemon::CameraFile camera = daemon::parse_camera_file(text, "camera.yaml", name);
  for (const std::string& notice : camera.notices)
    require(ipc::is_printable_line(notice), "a notice is one line");
  const calibration_t calibration = daemon::calibration_of(camera, "camera");
  const slam::Rig rig = daemon::make_rig(calibration, 0);
  const slam::Camera& model = rig.cameras.front().camera;
  for (const double share : {0.0, 0.3, 0.5, 1.0}) {
    Eigen::Vector3d ray;
    const Eigen::Vector2d pixel(share * (model.width_px() - 1), share * (model.height_px() - 1));
    if (model.unproject(pixel, &ray)) require(ray.allFinite(), "the ray of a pixel is finite");
  }
}

}  // namespace

void run_config(ByteView input) {
  const std::string text = text_of(input);
  expect_one_line([&] { check_config(text); });
  expect_one_line([&] { check_setting(text); });
}

void run_camera(ByteView input) {
  expect_one_line([&] { check_camera(text_of(input), ""); });
  expect_one_line([&] { check_camera(text_of(input), "cam1"); });
}

void run_world(ByteView input) {
  try {
    (void)tools::simulate::parse_world(text_of(input), "world.yaml");
  } catch (const daemon::InputError&) {  // refused; the program escapes what it prints
  }
}

std::vector<Bytes> seeds_of_config() {
  return {bytes_of("log: {level: info}\ncan:\n  messages: status position_xy/5\n  rate_hz: 5e1\n"),
          bytes_of("tracking:\n  min_inliers: 12\nlandmarks: {mode: baseline}\nscale:\n  assumed: 2.5\n"),
          bytes_of("camera.device=\"usb:1-2.3\"\n"), bytes_of("a: &x [1, *x]\n<<: {b: !tag |\n  text\n}\n"),
          shipped("config/farpoint.yaml")};
}

std::vector<Bytes> seeds_of_camera() {
  return {
      shipped("config/cameras/tum-freiburg1.yaml"),
      bytes_of(
          "model: kannala-brandt\nwidth_px: 64\nheight_px: 48\nfx_px: 30\nfy_px: 30\ncx_px: 32\ncy_px: 24\n"
          "distortion: [0.1, 0, 0, 0]\nT_body_camera: [0,0,1,0, -1,0,0,0, 0,-1,0,0, 0,0,0,1]\n"
          "rate_hz: 30\nrow_time_s: 1e-5\n"),
      // ROS, Kalibr and OpenCV, in this order.
      bytes_of(
          "image_width: 64\nimage_height: 48\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
          "  data: [50, 0, 31, 0, 51, 23, 0, 0, 1]\ndistortion_model: rational_polynomial\n"
          "distortion_coefficients:\n  rows: 1\n  cols: 8\n"
          "  data: [0.47, -2.4, 0.0005, -0.0002, 1.4, 0.35, -2.3, 1.3]\nmount: {z_m: 1, pitch_deg: 5}\n"),
      bytes_of("cam0:\n  camera_model: ds\n  distortion_coeffs: []\n  distortion_model: none\n"
               "  intrinsics: [-0.2, 0.57, 15, 15, 31, 23]\n  resolution: [64, 48]\ncam1:\n"
               "  camera_model: omni\n  T_cn_cnm1:\n  - [1.0, 0.0, 0.0, -0.11]\n  - [0.0, 1.0, 0.0, 0.02]\n"
               "  - [0.0, 0.0, 1.0, 0.003]\n  - [0.0, 0.0, 0.0, 1.0]\n"),
      bytes_of("%YAML:1.0\n---\nimage_width: 64\nimage_height: 48\nfisheye_model: 1\n"
               "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
               "   data: [ 5.0e+01, 0., 3.1e+01, 0., 5.1e+01, 2.3e+01, 0., 0., 1. ]\n"
               "distortion_coefficients: !!opencv-matrix\n   rows: 4\n   cols: 1\n   dt: d\n"
               "   data: [ 0.01, 0.02, 0.003, 0.004 ]\n")};
}

std::vector<Bytes> seeds_of_world() {
  return {shipped("config/worlds/yard.yaml"), shipped("config/worlds/hover.yaml")};
}

}  // namespace farpoint::fuzz
