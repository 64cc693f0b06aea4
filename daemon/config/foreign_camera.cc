// SPDX-License-Identifier: Apache-2.0
#include "daemon/config/foreign_camera.h"

#include <algorithm>
#include <array>
#include <span>

#include "daemon/config/errors.h"

namespace farpoint::daemon {
namespace {

constexpr std::array kMatrixKeys = {"camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "k"};
constexpr std::array kDistortionKeys = {"distortion_coefficients", "distCoeffs", "dist_coeffs",
                                        "Distortion_Coefficients", "D",          "d"};
constexpr std::array kWidthKeys = {"image_width", "image_Width", "width"};
constexpr std::array kHeightKeys = {"image_height", "image_Height", "height"};
constexpr int kMaxChain = 8;

// The first of these keys that the file has; empty where it has none.
std::string key_of(const YamlFile& yaml, std::span<const char* const> keys) {
  for (const char* key : keys)
    if (yaml.has(key)) return key;
  return "";
}

std::string required_key(const YamlFile& yaml, std::span<const char* const> keys) {
  std::string key = key_of(yaml, keys);
  if (key.empty()) throw InputError(yaml.path().string() + ": key '" + std::string(keys[0]) + "' is missing");
  return key;
}

// The numbers of a matrix, {rows, cols, data}, or of a plain list.
std::vector<double> matrix(const YamlFile& yaml, const std::string& key) {
  const YAML::Node node = yaml.require(key);
  if (!node.IsMap()) return yaml.numbers_in(node, key);
  const YAML::Node data = node["data"];
  if (!data.IsDefined()) yaml.fail(node, "expected rows, cols and data for '" + key + "'");
  std::vector<double> values = yaml.numbers_in(data, key);
  double cells = 1.0;
  for (const char* side : {"rows", "cols"}) {
    const YAML::Node count = node[side];
    if (count.IsDefined()) cells *= yaml.number_in(count, key);
  }
  if (node["rows"].IsDefined() && node["cols"].IsDefined() && cells != static_cast<double>(values.size()))
    yaml.fail(node, "expected rows x cols numbers for '" + key + "', found " + std::to_string(values.size()));
  return values;
}

void set_size(const YamlFile& yaml, Lens* lens) {
  lens->width_px = yaml.integer(required_key(yaml, kWidthKeys));
  lens->height_px = yaml.integer(required_key(yaml, kHeightKeys));
}

void set_camera_matrix(const YamlFile& yaml, Lens* lens) {
  const std::string key = required_key(yaml, kMatrixKeys);
  const YAML::Node node = yaml.require(key);
  const std::vector<double> k = matrix(yaml, key);
  if (k.size() != 9) {
    yaml.fail(node, "expected 9 numbers (a 3x3 matrix by rows) for '" + key + "', found " +
                        std::to_string(k.size()));
  }
  if (k[0] == 0.0) yaml.fail(node, "focal length 0 in '" + key + "': the camera is not calibrated");
  if (k[1] != 0.0 || k[3] != 0.0 || k[6] != 0.0 || k[7] != 0.0 || k[8] != 1.0)
    yaml.fail(node, "expected [fx 0 cx; 0 fy cy; 0 0 1] for '" + key + "', without skew");
  lens->fx_px = k[0];
  lens->fy_px = k[4];
  lens->cx_px = k[2];
  lens->cy_px = k[5];
}

// Coefficients in OpenCV's order: 0, 4, 5, 8, 12, or 14 without a tilt of the sensor.
void set_opencv_coefficients(const YamlFile& yaml, const YAML::Node& node, std::vector<double> values,
                             ForeignCamera* camera) {
  if (values.size() == 14 && values[12] == 0.0 && values[13] == 0.0) values.resize(12);
  static constexpr std::array<std::size_t, 5> kCounts = {0, 4, 5, 8, 12};
  if (std::find(kCounts.begin(), kCounts.end(), values.size()) == kCounts.end()) {
    yaml.fail(node, "expected 0, 4, 5, 8 or 12 distortion coefficients, found " +
                        std::to_string(values.size()) + " (14 only without tilt)");
  }
  camera->lens.distortion = Lens::Distortion::kOpenCv;
  std::copy(values.begin(), values.end(), camera->lens.coefficients.begin());
  if (camera->model.empty()) camera->model = values.size() > 5 ? "rational polynomial" : "radial-tangential";
}

void set_equidistant_coefficients(const YamlFile& yaml, const YAML::Node& node,
                                  const std::vector<double>& values, ForeignCamera* camera) {
  if (values.size() != 4)
    yaml.fail(node,
              "expected 4 equidistant coefficients k1 k2 k3 k4, found " + std::to_string(values.size()));
  camera->lens.distortion = Lens::Distortion::kEquidistant;
  std::copy(values.begin(), values.end(), camera->lens.coefficients.begin());
  camera->model = "equidistant";
}

// ---- ROS ----

// An image that is a part of the sensor's would need another principal point.
void refuse_partial_images(const YamlFile& yaml) {
  for (const char* key : {"binning_x", "binning_y"}) {
    if (yaml.has(key) && yaml.number(key) > 1.0)
      yaml.fail(yaml.require(key),
                std::string("expected ") + key + " 0 or 1, the calibration of whole images");
  }
  if (!yaml.has("roi") || !yaml.require("roi").IsMap()) return;
  for (const char* key : {"x_offset", "y_offset"}) {
    const YAML::Node offset = yaml.require("roi")[key];
    if (offset.IsDefined() && yaml.number_in(offset, key) != 0.0)
      yaml.fail(offset, std::string("expected roi.") + key + " 0, the calibration of whole images");
  }
}

void read_ros(const YamlFile& yaml, ForeignCamera* camera) {
  set_size(yaml, &camera->lens);
  set_camera_matrix(yaml, &camera->lens);
  refuse_partial_images(yaml);
  const std::string key = required_key(yaml, kDistortionKeys);
  const YAML::Node node = yaml.require(key);
  const std::vector<double> values = matrix(yaml, key);
  const std::string model = yaml.has("distortion_model") ? yaml.text("distortion_model") : "plumb_bob";
  if (model == "equidistant" || model == "fisheye")
    return set_equidistant_coefficients(yaml, node, values, camera);
  if (model != "plumb_bob" && model != "rational_polynomial" && !model.empty()) {
    yaml.fail(yaml.require("distortion_model"),
              "expected distortion_model 'plumb_bob', 'rational_polynomial' or 'equidistant', found '" +
                  model + "'");
  }
  set_opencv_coefficients(yaml, node, values, camera);
}

// ---- OpenCV ----

void read_opencv(const YamlFile& yaml, ForeignCamera* camera) {
  set_camera_matrix(yaml, &camera->lens);
  set_size(yaml, &camera->lens);
  const std::string key = required_key(yaml, kDistortionKeys);
  const YAML::Node node = yaml.require(key);
  const std::vector<double> values = matrix(yaml, key);
  const bool says = yaml.has("fisheye_model");
  if (says && yaml.integer("fisheye_model") != 0)
    return set_equidistant_coefficients(yaml, node, values, camera);
  if (!says && values.size() == 4) {
    yaml.fail(node,
              "4 coefficients are k1 k2 p1 p2 or cv::fisheye's, expected fisheye_model: 0 or 1 in the file");
  }
  set_opencv_coefficients(yaml, node, values, camera);
}

// ---- Kalibr ----

std::string chain_name(int index) {
  return "cam" + std::to_string(index);
}

YAML::Node child(const YamlFile& yaml, const YAML::Node& parent, const std::string& key) {
  const YAML::Node node = parent[key];
  if (!node.IsDefined() || node.IsNull()) yaml.fail(parent, "key '" + key + "' is missing");
  return node;
}

std::string word(const YamlFile& yaml, const YAML::Node& parent, const std::string& key) {
  const YAML::Node node = child(yaml, parent, key);
  if (!node.IsScalar()) yaml.fail(node, "expected a word for '" + key + "'");
  return node.Scalar();
}

std::vector<double> numbers(const YamlFile& yaml, const YAML::Node& parent, const std::string& key,
                            std::size_t count) {
  const YAML::Node node = child(yaml, parent, key);
  std::vector<double> values = yaml.numbers_in(node, key);
  if (values.size() != count) {
    yaml.fail(node, "expected " + std::to_string(count) + " numbers for '" + key + "', found " +
                        std::to_string(values.size()));
  }
  return values;
}

// intrinsics: the shape's parameters, then fu fv pu pv.
void set_kalibr_shape(const YamlFile& yaml, const YAML::Node& node, Lens* lens) {
  const std::string model = word(yaml, node, "camera_model");
  std::size_t before = 0;
  if (model == "pinhole") {
    lens->shape = Lens::Shape::kPinhole;
  } else if (model == "omni") {
    lens->shape = Lens::Shape::kUnified;
    before = 1;
  } else if (model == "ds") {
    lens->shape = Lens::Shape::kDoubleSphere;
    before = 2;
  } else if (model == "eucm") {
    lens->shape = Lens::Shape::kExtendedUnified;
    before = 2;
  } else {
    yaml.fail(node["camera_model"],
              "expected camera_model 'pinhole', 'omni', 'ds' or 'eucm', found '" + model + "'");
  }
  const std::vector<double> values = numbers(yaml, node, "intrinsics", before + 4);
  for (std::size_t i = 0; i < before; ++i) lens->shape_parameters[i] = values[i];
  lens->fx_px = values[before];
  lens->fy_px = values[before + 1];
  lens->cx_px = values[before + 2];
  lens->cy_px = values[before + 3];
}

void set_kalibr_distortion(const YamlFile& yaml, const YAML::Node& node, Lens* lens) {
  const std::string model = word(yaml, node, "distortion_model");
  if (model == "none") return;
  const bool equidistant = model == "equi" || model == "equidistant", fov = model == "fov";
  const YAML::Node name = node["distortion_model"];
  if (!equidistant && !fov && model != "radtan")
    yaml.fail(name, "expected distortion_model 'radtan', 'equi', 'fov' or 'none', found '" + model + "'");
  if (equidistant && lens->shape != Lens::Shape::kPinhole)
    yaml.fail(name, "expected 'equi' with camera_model 'pinhole' only");
  const std::vector<double> values = numbers(yaml, node, "distortion_coeffs", fov ? 1 : 4);
  if (fov && !(values[0] > 1e-3 && values[0] < 3.0))
    yaml.fail(node["distortion_coeffs"], "expected an angle of 0.001 to 3 rad for the 'fov' distortion");
  if (equidistant) lens->distortion = Lens::Distortion::kEquidistant;
  if (fov) lens->distortion = Lens::Distortion::kFieldOfView;
  std::copy(values.begin(), values.end(), lens->coefficients.begin());
}

slam::SE3 kalibr_motion(const YamlFile& yaml, const YAML::Node& node, const std::string& key) {
  const YAML::Node rows = child(yaml, node, key);
  std::vector<double> values;
  if (rows.IsSequence()) {
    for (const YAML::Node& row : rows) {
      // Aliases make a short file long: no more is read than a matrix has.
      if (values.size() >= 16 || row.size() > 4)
        yaml.fail(row, "expected 4 rows of 4 numbers for '" + key + "'");
      const std::vector<double> numbers = yaml.numbers_in(row, key);
      values.insert(values.end(), numbers.begin(), numbers.end());
    }
  }
  if (values.size() != 16) yaml.fail(rows, "expected a 4x4 matrix, a list of 4 rows, for '" + key + "'");
  const Eigen::Matrix4d matrix = Eigen::Map<const Eigen::Matrix4d>(values.data()).transpose();
  slam::SE3 motion;
  if (matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1) || !to_rigid_motion(matrix.topRows<3>(), &motion))
    yaml.fail(rows, "expected a rotation and a translation, last row 0 0 0 1, for '" + key + "'");
  return motion;
}

void read_kalibr(const YamlFile& yaml, const std::string& wanted, ForeignCamera* camera) {
  std::vector<std::string> names;
  for (int i = 0; i < kMaxChain && yaml.has(chain_name(i)); ++i) names.push_back(chain_name(i));
  const auto chosen = wanted.empty() ? names.begin() : std::find(names.begin(), names.end(), wanted);
  if (chosen == names.end()) {
    throw InputError(yaml.path().string() + ": no camera '" + wanted + "', expected one of " + names.front() +
                     " to " + names.back());
  }
  slam::SE3 T_camera0_camera;
  for (auto name = names.begin() + 1; name <= chosen; ++name) {
    const YAML::Node node = yaml.require(*name);
    if (!node.IsMap()) yaml.fail(node, "expected keys of a camera below '" + *name + "'");
    T_camera0_camera = T_camera0_camera * kalibr_motion(yaml, node, "T_cn_cnm1").inverse();
  }
  const YAML::Node node = yaml.require(*chosen);
  if (!node.IsMap()) yaml.fail(node, "expected keys of a camera below '" + *chosen + "'");
  set_kalibr_shape(yaml, node, &camera->lens);
  set_kalibr_distortion(yaml, node, &camera->lens);
  const std::vector<double> size = numbers(yaml, node, "resolution", 2);
  for (const double side : size)
    if (!(side >= 1.0 && side <= 1e6)) yaml.fail(node["resolution"], "expected a resolution in pixels");
  camera->lens.width_px = static_cast<int>(size[0]);
  camera->lens.height_px = static_cast<int>(size[1]);
  camera->model = word(yaml, node, "camera_model") + "-" + word(yaml, node, "distortion_model");
  camera->name = *chosen;
  std::copy_if(names.begin(), names.end(), std::back_inserter(camera->others),
               [&](const std::string& name) { return name != *chosen; });
  if (names.size() > 1) camera->T_camera0_camera = T_camera0_camera;
}

}  // namespace

CalibrationKind kind_of(const YamlFile& yaml) {
  if (yaml.has("cam0")) return CalibrationKind::kKalibr;
  const std::string key = key_of(yaml, kMatrixKeys);
  if (key.empty()) return CalibrationKind::kFarpoint;
  return yaml.require(key).Tag().ends_with("opencv-matrix") ? CalibrationKind::kOpenCv
                                                            : CalibrationKind::kRos;
}

const char* to_string(CalibrationKind kind) {
  switch (kind) {
    case CalibrationKind::kFarpoint:
      return "camera file";
    case CalibrationKind::kRos:
      return "ROS camera_info";
    case CalibrationKind::kKalibr:
      return "Kalibr camchain";
    case CalibrationKind::kOpenCv:
      return "OpenCV FileStorage";
  }
  return "?";
}

ForeignCamera read_foreign_camera(const YamlFile& yaml, CalibrationKind kind, const std::string& name) {
  ForeignCamera camera;
  if (kind == CalibrationKind::kKalibr) {
    read_kalibr(yaml, name, &camera);
  } else if (kind == CalibrationKind::kOpenCv) {
    read_opencv(yaml, &camera);
  } else {
    read_ros(yaml, &camera);
  }
  return camera;
}

void refuse_other_syntax(const std::string& content, const std::filesystem::path& file) {
  const std::string head = content.substr(0, 512);
  const std::string name = file.string();
  if (head.starts_with("<?xml"))
    throw InputError(name + ": XML, expected YAML (cv::FileStorage writes it for names that end in .yaml)");
  if (head.starts_with("# oST") || head.starts_with("[image]"))
    throw InputError(name + ": a ROS calibration in INI form, expected its YAML form (ost.yaml)");
}

}  // namespace farpoint::daemon
