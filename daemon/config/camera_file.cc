// SPDX-License-Identifier: Apache-2.0
#include "daemon/config/camera_file.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "daemon/config/calibration_message.h"
#include "daemon/config/errors.h"
#include "daemon/config/foreign_camera.h"
#include "daemon/config/yaml_file.h"
#include "ipc/file_kind.h"
#include "ipc/image_codec.h"
#include "ipc/printable.h"

namespace farpoint::daemon {
namespace {

constexpr double kMaxRowTime_s = 1e-3;  // 1 ms a row is half a second an image: certainly another unit
constexpr double kRadToDeg = 180.0 / std::numbers::pi;
// Narrower cameras are a focal length in another unit, or of another image size.
constexpr double kMinView_deg = 5.0, kNarrowView_deg = 20.0;
// Optical axis above the horizon from which the axes are probably mistaken.
constexpr double kMaxElevation_deg = 45.0;
constexpr double kMaxMount_m = 100.0, kMaxMount_deg = 360.0;

slam::SE3 forward_looking() {
  return {slam::q_body_forward_camera(), Eigen::Vector3d::Zero()};
}

slam::CameraModel read_model(const YamlFile& yaml) {
  const std::string model = yaml.text("model");
  if (model == "pinhole-radtan") return slam::CameraModel::kPinholeRadtan;
  if (model == "kannala-brandt") return slam::CameraModel::kKannalaBrandt;
  yaml.fail(yaml.require("model"),
            "expected model 'pinhole-radtan' or 'kannala-brandt', found '" + model + "'");
}

slam::Camera::Parameters read_own_parameters(const YamlFile& yaml) {
  yaml.allow_only({"model", "width_px", "height_px", "fx_px", "fy_px", "cx_px", "cy_px", "distortion",
                   "T_body_camera", "mount", "rate_hz", "row_time_s"});
  slam::Camera::Parameters p;
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
  return p;
}

// ---- mounting ----

double mount_value(const YamlFile& yaml, const YAML::Node& mount, const std::string& key, double most) {
  const YAML::Node node = mount[key];
  if (!node.IsDefined()) return 0.0;
  const double value = yaml.number_in(node, "mount." + key);
  if (std::abs(value) > most)
    yaml.fail(node, fmt::format("expected mount.{} within -{} to {}", key, most, most));
  return value;
}

// Position on the body, and the turn from a camera that looks along x, upright: roll about x, then pitch
// about y, then yaw about z.
slam::SE3 read_mount(const YamlFile& yaml) {
  const YAML::Node mount = yaml.require("mount");
  static const std::vector<std::string> kKeys = {"x_m", "y_m", "z_m", "roll_deg", "pitch_deg", "yaw_deg"};
  if (!mount.IsMap()) yaml.fail(mount, "expected {x_m, y_m, z_m, roll_deg, pitch_deg, yaw_deg} for 'mount'");
  for (const auto& entry : mount) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "?";
    if (std::find(kKeys.begin(), kKeys.end(), key) == kKeys.end())
      yaml.fail(entry.first, "unknown key '" + key +
                                 "' in 'mount', expected x_m, y_m, z_m, roll_deg, pitch_deg or yaw_deg");
  }
  double length[3], angle_rad[3];
  for (std::size_t i = 0; i < 3; ++i) {
    length[i] = mount_value(yaml, mount, kKeys[i], kMaxMount_m);
    angle_rad[i] = mount_value(yaml, mount, kKeys[i + 3], kMaxMount_deg) / kRadToDeg;
  }
  const Eigen::Quaterniond turn = Eigen::AngleAxisd(angle_rad[2], Eigen::Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(angle_rad[1], Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(angle_rad[0], Eigen::Vector3d::UnitX());
  return {(turn * slam::q_body_forward_camera()).normalized(), {length[0], length[1], length[2]}};
}

std::optional<slam::SE3> read_T_body_camera(const YamlFile& yaml) {
  const bool has_matrix = yaml.has("T_body_camera"), has_mount = yaml.has("mount");
  if (has_matrix && has_mount)
    yaml.fail(yaml.require("mount"), "expected one of 'mount' and 'T_body_camera', found both");
  if (has_mount) return read_mount(yaml);
  if (has_matrix) return yaml.rigid_motion(yaml.require("T_body_camera"), "T_body_camera");
  return {};
}

// ---- calibrations of other tools ----

std::string share_text(double share) {
  return share < 1.0 ? fmt::format(" over {:.0f} % of the image, the part with rays", 100.0 * share)
                     : std::string(" over the image");
}

// The lens as a camera of slam, converted where there is no such model.
slam::Camera::Parameters parameters_of(const YamlFile& yaml, const ForeignCamera& foreign,
                                       std::vector<std::string>* notices) {
  if (const std::optional<slam::Camera::Parameters> same = foreign.lens.native()) return *same;
  const std::optional<LensFit> fit = fit_lens(foreign.lens);
  if (!fit) {
    throw InputError(yaml.path().string() + ": the " + foreign.model +
                     " model has no rays for most of the image, or rays that no supported model has; are the "
                     "parameters' order and signs right?");
  }
  const bool radtan = fit->parameters.model == slam::CameraModel::kPinholeRadtan;
  const std::string error = fmt::format("{} as {}: error {:.3f} px RMS, {:.3f} px at most{}", foreign.model,
                                        radtan ? "pinhole-radtan" : "kannala-brandt", fit->rms_px,
                                        fit->max_px, share_text(fit->share));
  if (fit->max_px > kMaxConversionError_px) {
    throw InputError(fmt::format(
        "{}: {}, expected at most {} px: calibrate with radial-tangential or equidistant distortion",
        yaml.path().string(), error, kMaxConversionError_px));
  }
  notices->push_back(error);
  return fit->parameters;
}

void check_side(const YamlFile& yaml, const char* name, int side_px) {
  if (side_px >= 1 && side_px <= ipc::kMaxImageSide_px) return;
  throw InputError(fmt::format("{}: camera: {} is {}, expected 1 to {} pixels", yaml.path().string(), name,
                               side_px, ipc::kMaxImageSide_px));
}

void read_foreign(const YamlFile& yaml, CalibrationKind kind, const std::string& name, CameraFile* camera) {
  const ForeignCamera foreign = read_foreign_camera(yaml, kind, name);
  check_side(yaml, "width", foreign.lens.width_px);
  check_side(yaml, "height", foreign.lens.height_px);
  slam::Camera::Parameters pinhole;  // what slam asks of any camera, before a lens is followed
  pinhole.width_px = foreign.lens.width_px;
  pinhole.height_px = foreign.lens.height_px;
  pinhole.fx_px = foreign.lens.fx_px;
  pinhole.fy_px = foreign.lens.fy_px;
  pinhole.cx_px = foreign.lens.cx_px;
  pinhole.cy_px = foreign.lens.cy_px;
  const std::string complaint = slam::Camera::check(pinhole);
  if (!complaint.empty()) throw InputError(yaml.path().string() + ": " + complaint);
  camera->parameters = parameters_of(yaml, foreign, &camera->notices);
  if (foreign.T_camera0_camera) {
    camera->T_body_camera = camera->T_body_camera.value_or(forward_looking()) * *foreign.T_camera0_camera;
  }
  if (name.empty() && !foreign.others.empty()) {
    camera->notices.push_back(fmt::format("{} of {} cameras is taken, {}#{} takes another", foreign.name,
                                          foreign.others.size() + 1, yaml.path().string(),
                                          foreign.others.front()));
  }
}

// ---- absurd cameras ----

// Angle between the rays of the left and right edge; empty where they have none.
std::optional<double> view_deg(const slam::Camera& camera) {
  Eigen::Vector3d left, right;
  const double v = camera.parameters().cy_px;
  if (!camera.unproject({0.0, v}, &left) || !camera.unproject({camera.width_px() - 1.0, v}, &right))
    return {};
  return kRadToDeg * std::acos(std::clamp(left.dot(right), -1.0, 1.0));
}

void check_view(const YamlFile& yaml, CameraFile* camera) {
  const std::optional<double> view = view_deg(slam::Camera(camera->parameters));
  if (!view || *view >= kNarrowView_deg || camera->parameters.width_px < 2) return;
  const std::string text = fmt::format("the image is {:.1f} degrees wide (fx {:.6g} px, {} px)", *view,
                                       camera->parameters.fx_px, camera->parameters.width_px);
  if (*view < kMinView_deg) {
    throw InputError(fmt::format("{}: {}, expected at least {}: is fx in pixels, of images of this size?",
                                 yaml.path().string(), text, kMinView_deg));
  }
  camera->notices.push_back(text + ": is fx in pixels, of images of this size?");
}

void check_elevation(CameraFile* camera) {
  if (!camera->T_body_camera) return;
  const Eigen::Vector3d axis = camera->T_body_camera->q * Eigen::Vector3d::UnitZ();
  const double elevation_deg = kRadToDeg * std::asin(std::clamp(axis.z(), -1.0, 1.0));
  if (elevation_deg <= kMaxElevation_deg) return;
  camera->notices.push_back(fmt::format(
      "the camera looks {:.0f} degrees above the horizon: T_body_camera maps camera axes (z forward) "
      "to body axes (z up), and mount.pitch_deg is positive downwards",
      elevation_deg));
}

CameraFile read_camera(const YamlFile& yaml, const std::string& name) {
  const CalibrationKind kind = kind_of(yaml);
  if (!name.empty() && kind != CalibrationKind::kKalibr)
    throw InputError(yaml.path().string() + ": no camera '" + name +
                     "', expected a Kalibr camchain for #NAME");
  CameraFile camera;
  if (kind == CalibrationKind::kFarpoint) camera.parameters = read_own_parameters(yaml);
  camera.T_body_camera = read_T_body_camera(yaml);
  if (kind != CalibrationKind::kFarpoint) read_foreign(yaml, kind, name, &camera);
  const std::string complaint = slam::Camera::check(camera.parameters);
  if (!complaint.empty()) throw InputError(yaml.path().string() + ": " + complaint);
  check_side(yaml, "width", camera.parameters.width_px);
  check_side(yaml, "height", camera.parameters.height_px);
  camera.rate_hz = yaml.number_or("rate_hz", 0.0);
  if (camera.rate_hz < 0.0) yaml.fail(yaml.require("rate_hz"), "expected rate_hz >= 0 (0: unknown)");
  camera.row_time_s = yaml.number_or("row_time_s", -1.0);
  if (camera.row_time_s > kMaxRowTime_s) {
    yaml.fail(yaml.require("row_time_s"),
              "expected row_time_s in seconds, at most 0.001 (0: global, negative: unknown)");
  }
  check_view(yaml, &camera);
  check_elevation(&camera);
  return camera;
}

// Splits FILE#NAME; NAME is empty where there is a file of that whole name.
std::filesystem::path split_name(const std::filesystem::path& file, std::string* name) {
  const std::string text = file.string();
  const std::size_t mark = text.rfind('#');
  std::error_code ignored;
  if (mark == std::string::npos || text.find('/', mark) != std::string::npos ||
      std::filesystem::exists(file, ignored))
    return file;
  *name = text.substr(mark + 1);
  return text.substr(0, mark);
}

}  // namespace

CameraFile read_camera_file(const std::filesystem::path& file) {
  std::string name;
  const std::filesystem::path path = split_name(file, &name);
  const std::string wrong = ipc::wrong_kind(path.string(), "a camera file", false);
  if (!wrong.empty()) throw InputError(ipc::printable(wrong));
  return parse_camera_file(read_short_file(path), path, name);
}

// OpenCV's first line "%YAML:1.0" is no YAML; as a comment it keeps the lines' numbers.
CameraFile parse_camera_file(const std::string& content, const std::filesystem::path& file,
                             const std::string& name) {
  refuse_other_syntax(content, file);
  std::string text = content;
  if (text.starts_with("%YAML:")) text[0] = '#';
  return read_camera(YamlFile(file, text), name);
}

calibration_t calibration_of(const CameraFile& camera, const std::string& name) {
  calibration_t message{};
  message.body_name = camera.T_body_camera ? "body" : "";
  message.ncameras = 1;
  message.cameras = {camera_message(name, camera.parameters, camera.T_body_camera.value_or(forward_looking()),
                                    camera.rate_hz, camera.row_time_s)};
  message.imu_orientation[0] = 1.0;
  return message;
}

calibration_t read_stereo_calibration(const std::filesystem::path& first, const std::filesystem::path& second,
                                      std::vector<std::string>* notices) {
  const CameraFile cameras[] = {read_camera_file(first), read_camera_file(second)};
  const std::filesystem::path* const files[] = {&first, &second};
  for (int i = 0; i < 2; ++i) {
    for (const std::string& notice : cameras[i].notices)
      notices->push_back(files[i]->string() + ": " + notice);
    if (cameras[i].T_body_camera) continue;
    throw InputError(files[i]->string() +
                     ": no T_body_camera, expected it in the files of both cameras of a stereo "
                     "pair, to place them "
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
