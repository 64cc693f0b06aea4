// SPDX-License-Identifier: Apache-2.0
#include "tools/import/kaist.h"

#include <algorithm>
#include <array>
#include <map>
#include <numbers>

#include "daemon/config/camera_file.h"
#include "daemon/config/yaml_file.h"
#include "ipc/image_encoder.h"
#include "tools/common/errors.h"
#include "tools/common/text_file.h"
#include "tools/import/rectified_pair.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

// ---- calibration ----

// Lines "R: 9 numbers" and "T: 3 numbers": T_vehicle_sensor.
slam::SE3 read_place(const fs::path& file) {
  const FieldFile text(file, kBlanks);
  Eigen::Matrix<double, 3, 4> matrix = Eigen::Matrix<double, 3, 4>::Zero();
  bool has_rotation = false, has_translation = false;
  for (const FieldLine& line : text.lines()) {
    if (line.text(0) == "R:") {
      line.require_fields(10, "R: and a 3x3 matrix by rows");
      for (int i = 0; i < 9; ++i) matrix(i / 3, i % 3) = line.number_at(static_cast<std::size_t>(i) + 1, "R");
      has_rotation = true;
    } else if (line.text(0) == "T:") {
      line.require_fields(4, "T: x y z");
      for (int i = 0; i < 3; ++i) matrix(i, 3) = line.number_at(static_cast<std::size_t>(i) + 1, "T");
      has_translation = true;
    }
  }
  slam::SE3 T_vehicle_sensor;
  if (!has_rotation || !has_translation || !daemon::to_rigid_motion(matrix, &T_vehicle_sensor))
    throw InputError(file.string() + ": expected lines 'R: ' with a rotation and 'T: ' with 3 numbers");
  return T_vehicle_sensor;
}

template <std::size_t N>
std::array<double, N> matrix_of(const daemon::YamlFile& yaml, const std::string& key) {
  const YAML::Node node = yaml.require(key);
  const std::vector<double> values = yaml.numbers_in(node.IsMap() ? node["data"] : node, key);
  if (values.size() != N)
    yaml.fail(node, "expected " + std::to_string(N) + " numbers for '" + key + "', found " +
                        std::to_string(values.size()));
  std::array<double, N> array{};
  std::copy(values.begin(), values.end(), array.begin());
  return array;
}

Rectification read_rectification(const fs::path& file) {
  std::string content = daemon::read_short_file(file);
  if (content.starts_with("%")) content.insert(0, "#");  // OpenCV's directive is none of YAML
  const daemon::YamlFile yaml(file, content);
  return rectification_of(matrix_of<9>(yaml, "rectification_matrix"),
                          matrix_of<12>(yaml, "projection_matrix"));
}

void read_cameras(const fs::path& folder, bool stereo, Recording* recording) {
  add_camera(folder / "left.yaml", "stereo_left", recording);
  recording->cameras[0].T_body_camera = read_place(folder / "Vehicle2Stereo.txt");
  recording->body_name = "vehicle";
  if (!stereo) return;
  add_camera(folder / "right.yaml", "stereo_right", recording);
  const std::optional<slam::SE3> T_left_right =
      second_camera(read_rectification(folder / "left.yaml"), read_rectification(folder / "right.yaml"));
  if (!T_left_right)
    throw InputError((folder / "right.yaml").string() +
                     ": expected the rectification of a pair: a rotation, and -fx * baseline in "
                     "projection_matrix");
  recording->cameras[1].T_body_camera = recording->cameras[0].T_body_camera * *T_left_right;
}

// ---- images ----

std::int64_t next_utime(const FieldLine& line, std::int64_t last_utime) {
  const std::int64_t utime = line.utime_from_nanoseconds_at(0, "the stamp [ns]");
  if (utime <= last_utime)
    line.fail("expected a stamp after the one above, found " + std::string(line.text(0)));
  return utime;
}

void read_images(const fs::path& root, std::size_t cameras, Recording* recording) {
  constexpr std::array kFolders = {"stereo_left", "stereo_right"};
  const fs::path list = root / "sensor_data" / "stereo_stamp.csv";
  const FieldFile text(list, kCommaAndBlanks);
  std::int64_t last_utime = -1, sequence = 0;
  for (const FieldLine& line : text.lines()) {
    last_utime = next_utime(line, last_utime);
    const std::string name = std::to_string(line.integer_at(0, "the stamp")) + ".png";
    for (std::size_t camera = 0; camera < cameras; ++camera) {
      const fs::path file = root / "image" / kFolders[camera] / name;
      if (fs::is_regular_file(file)) {
        recording->images.push_back({last_utime, sequence, static_cast<int>(camera), file});
      } else {
        ++recording->missing_images;
      }
    }
    ++sequence;
  }
  for (std::size_t camera = 0; camera < cameras; ++camera) {
    const auto is_its = [&](const RecordingImage& image) { return image.camera == static_cast<int>(camera); };
    if (std::none_of(recording->images.begin(), recording->images.end(), is_its))
      throw InputError(list.string() + ": none of its stamps is an image in " +
                       (root / "image" / kFolders[camera]).string());
  }
}

// ---- sensors ----

void read_imu(const fs::path& file, Recording* recording) {
  const FieldFile text(file, kCommaAndBlanks);
  std::int64_t last_utime = -1;
  for (const FieldLine& line : text.lines()) {
    line.require_fields(14, "stamp [ns],qx,qy,qz,qw,3 angles,wx,wy,wz [rad/s],ax,ay,az [m/s^2],...");
    RecordingImu sample;
    sample.utime = last_utime = next_utime(line, last_utime);
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      sample.angular_velocity_radps[axis] = line.number_at(8 + i, "the angular velocity");
      sample.acceleration_mps2[axis] = line.number_at(11 + i, "the acceleration");
    }
    recording->imu.push_back(sample);
  }
}

struct Encoders {
  double left_m = 0.0, right_m = 0.0;  // of one count
  double base_m = 0.0;                 // from wheel to wheel
};

Encoders read_encoders(const fs::path& file) {
  const FieldFile text(file, "");
  std::map<std::string, double> values;
  for (const FieldLine& line : text.lines()) {
    const std::string content(line.text(0));
    const std::size_t colon = content.find(':');
    if (colon == std::string::npos) continue;  // a title
    const FieldLine number(&file, line.number(), content.substr(colon + 1), kBlanks);
    if (number.size() == 0) line.fail("expected a number behind the colon");
    values[content.substr(0, colon)] = number.number_at(0, content.substr(0, colon));
  }
  const auto positive = [&](const char* key) {
    if (!(values[key] > 0.0)) throw InputError(file.string() + ": expected '" + key + ": number' above 0");
    return values[key];
  };
  const double counts = positive("Encoder resolution");
  return {std::numbers::pi * positive("Encoder left wheel diameter") / counts,
          std::numbers::pi * positive("Encoder right wheel diameter") / counts,
          positive("Encoder wheel base")};
}

void read_wheels(const fs::path& root, Recording* recording) {
  const Encoders encoders = read_encoders(root / "calibration" / "EncoderParameter.txt");
  const FieldFile text(root / "sensor_data" / "encoder.csv", kCommaAndBlanks);
  std::int64_t last_utime = -1, last_left = 0, last_right = 0;
  for (const FieldLine& line : text.lines()) {
    line.require_fields(3, "stamp [ns],left count,right count");
    const std::int64_t utime = next_utime(line, last_utime);
    const std::int64_t left = line.integer_at(1, "the left count"),
                       right = line.integer_at(2, "the right count");
    if (last_utime >= 0) {
      const double seconds = static_cast<double>(utime - last_utime) * 1e-6;
      const double left_mps = static_cast<double>(left - last_left) * encoders.left_m / seconds;
      const double right_mps = static_cast<double>(right - last_right) * encoders.right_m / seconds;
      recording->wheels.push_back({last_utime + (utime - last_utime) / 2, 0.5 * (left_mps + right_mps),
                                   (right_mps - left_mps) / encoders.base_m});
    }
    last_utime = utime;
    last_left = left;
    last_right = right;
  }
}

void read_truth(const fs::path& file, Recording* recording) {
  const FieldFile text(file, kCommaAndBlanks);
  std::int64_t last_utime = -1;
  for (const FieldLine& line : text.lines()) {
    line.require_fields(13, "stamp [ns] and a 3x4 pose matrix by rows");
    RecordingTruth truth;
    truth.utime = last_utime = next_utime(line, last_utime);
    Eigen::Matrix<double, 3, 4> matrix;
    for (int i = 0; i < 12; ++i)
      matrix(i / 4, i % 4) = line.number_at(static_cast<std::size_t>(i) + 1, "the pose");
    if (!daemon::to_rigid_motion(matrix, &truth.T_world_body))
      line.fail("expected a rotation (orthonormal, determinant +1) in the pose");
    recording->truth.push_back(truth);
  }
}

void read_sensors(const fs::path& root, Damaged damaged, Recording* recording) {
  const fs::path imu = root / "sensor_data" / "xsens_imu.csv", truth = root / "global_pose.csv";
  const auto read_imu_and_place = [&] {
    ImuCalibration calibration;
    calibration.T_body_imu = read_place(root / "calibration" / "Vehicle2IMU.txt");
    read_imu(imu, recording);
    recording->imu_calibration = calibration;
  };
  if (fs::exists(imu)) read_sensor(damaged, read_imu_and_place, &recording->imu, recording);
  if (fs::exists(root / "sensor_data" / "encoder.csv"))
    read_sensor(
        damaged, [&] { read_wheels(root, recording); }, &recording->wheels, recording);
  if (fs::exists(truth))
    read_sensor(
        damaged, [&] { read_truth(truth, recording); }, &recording->truth, recording);
}

// ---- Bayer patterns ----

// Weights 1 2 1 along rows and columns, in which each colour has the same share at every pixel. At the edge
// the pattern goes on by reflection, which keeps the colours' order.
std::vector<std::uint8_t> luma_of(const std::vector<std::uint8_t>& bayer, int width, int height) {
  const auto inside = [](int i, int size) { return i < 0 ? -i : i >= size ? 2 * size - 2 - i : i; };
  const auto at = [&](int x, int y) {
    return unsigned{bayer[static_cast<std::size_t>(inside(y, height)) * static_cast<std::size_t>(width) +
                          static_cast<std::size_t>(inside(x, width))]};
  };
  std::vector<std::uint8_t> luma;
  luma.reserve(bayer.size());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto row = [&](int line) { return at(x - 1, line) + 2 * at(x, line) + at(x + 1, line); };
      luma.push_back(static_cast<std::uint8_t>((row(y - 1) + 2 * row(y) + row(y + 1) + 8) / 16));
    }
  }
  return luma;
}

}  // namespace

Recording read_kaist(const fs::path& root, Damaged damaged) {
  require_folder(root, "'image' and 'sensor_data', a KAIST Urban recording");
  const fs::path left = root / "image" / "stereo_left";
  if (!fs::is_directory(left))
    throw InputError(left.string() + ": no such folder, expected that of a KAIST Urban recording");
  const bool stereo = fs::is_directory(root / "image" / "stereo_right");
  Recording recording;
  read_cameras(root / "calibration", stereo, &recording);
  read_images(root, stereo ? 2 : 1, &recording);
  read_sensors(root, damaged, &recording);
  complete_cameras(root / "calibration", &recording);
  return recording;
}

std::string read_kaist_image(const RecordingImage& image) {
  const std::string bytes = read_image_file(image.file);
  const ipc::ImageInfo info = probe_image_file(bytes, image.file);
  image_t message{};
  message.width = info.width_px;
  message.height = info.height_px;
  message.pixel_format = info.pixel_format;
  message.data.assign(bytes.begin(), bytes.end());
  message.size = static_cast<std::int32_t>(message.data.size());
  ipc::ImageDecoder decoder;
  ipc::GreyImage grey;
  if (decoder.decode(message, &grey) != ipc::ImageStatus::kOk || info.width_px < 2 || info.height_px < 2)
    throw InputError(image.file.string() + ": expected a PNG image of a Bayer pattern, found a damaged one");
  const std::vector<std::uint8_t> luma = luma_of(grey.pixels, info.width_px, info.height_px);
  const std::vector<std::uint8_t> png = ipc::encode_png({info.width_px, info.height_px, luma});
  return {png.begin(), png.end()};
}

}  // namespace farpoint::tools
