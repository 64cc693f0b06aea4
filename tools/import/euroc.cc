// SPDX-License-Identifier: Apache-2.0
#include "tools/import/euroc.h"

#include <array>
#include <map>
#include <set>

#include "daemon/config/yaml_file.h"
#include "tools/common/errors.h"
#include "tools/common/text_file.h"

namespace farpoint::tools {

using daemon::YamlFile;
namespace {

namespace fs = std::filesystem;

// Reads T_BS, which OpenCV-style files nest as {cols, rows, data}.
slam::SE3 read_extrinsics(const YamlFile& yaml) {
  const YAML::Node node = yaml.require("T_BS");
  return yaml.rigid_motion(node.IsMap() ? node["data"] : node, "T_BS");
}

RecordingCamera read_camera(const fs::path& folder) {
  const YamlFile yaml(folder / "sensor.yaml");
  RecordingCamera camera;
  camera.name = folder.filename().string();
  camera.T_body_camera = read_extrinsics(yaml);
  camera.rate_hz = yaml.number_or("rate_hz", 0.0);
  if (yaml.text("camera_model") != "pinhole")
    yaml.fail(yaml.require("camera_model"), "expected camera_model 'pinhole'");

  const std::string distortion_model = yaml.text("distortion_model");
  const bool equidistant = distortion_model == "equidistant";
  if (!equidistant && distortion_model != "radial-tangential") {
    yaml.fail(
        yaml.require("distortion_model"),
        "expected distortion_model 'radial-tangential' or 'equidistant', found '" + distortion_model + "'");
  }
  slam::Camera::Parameters& p = camera.parameters;
  p.model = equidistant ? slam::CameraModel::kKannalaBrandt : slam::CameraModel::kPinholeRadtan;
  const std::vector<double> size = yaml.numbers("resolution", {2});
  p.width_px = static_cast<int>(size[0]);
  p.height_px = static_cast<int>(size[1]);
  const std::vector<double> intrinsics = yaml.numbers("intrinsics", {4});
  p.fx_px = intrinsics[0];
  p.fy_px = intrinsics[1];
  p.cx_px = intrinsics[2];
  p.cy_px = intrinsics[3];
  const std::vector<double> distortion = yaml.numbers(
      "distortion_coefficients", equidistant ? std::vector<std::size_t>{4} : std::vector<std::size_t>{4, 5});
  std::copy(distortion.begin(), distortion.end(), p.distortion.begin());
  return camera;
}

ImuCalibration read_imu_calibration(const fs::path& folder) {
  const YamlFile yaml(folder / "sensor.yaml");
  ImuCalibration imu;
  imu.T_body_imu = read_extrinsics(yaml);
  imu.rate_hz = yaml.number_or("rate_hz", 0.0);
  imu.gyro_noise_density = yaml.number_or("gyroscope_noise_density", 0.0);
  imu.gyro_random_walk = yaml.number_or("gyroscope_random_walk", 0.0);
  imu.accel_noise_density = yaml.number_or("accelerometer_noise_density", 0.0);
  imu.accel_random_walk = yaml.number_or("accelerometer_random_walk", 0.0);
  return imu;
}

// Time of a CSV line, checked to lie after the last one's.
std::int64_t next_utime(const FieldLine& line, std::int64_t last_utime) {
  const std::int64_t utime = line.utime_from_nanoseconds_at(0, "the timestamp [ns]");
  if (utime <= last_utime)
    line.fail("expected a timestamp after the one above, found " + std::string(line.text(0)));
  return utime;
}

// utime -> file of every image that a camera's data.csv lists and that exists; the absent ones are counted.
std::map<std::int64_t, fs::path> read_image_list(const fs::path& folder, std::size_t* missing) {
  const FieldFile text(folder / "data.csv", kCommaAndBlanks);
  std::map<std::int64_t, fs::path> images;
  std::int64_t last_utime = -1;
  for (const FieldLine& line : text.lines()) {
    line.require_fields(2, "timestamp [ns],filename");
    last_utime = next_utime(line, last_utime);
    const fs::path file = folder / "data" / std::string(line.text(1));
    if (fs::exists(file)) {
      images[last_utime] = file;
    } else {
      ++*missing;
    }
  }
  return images;
}

void add_images(const std::vector<std::map<std::int64_t, fs::path>>& camera_images, Recording* recording) {
  std::set<std::int64_t> utimes;
  for (const auto& images : camera_images) {
    for (const auto& [utime, file] : images) utimes.insert(utime);
  }
  std::int64_t sequence = 0;
  for (const std::int64_t utime : utimes) {
    for (std::size_t c = 0; c < camera_images.size(); ++c) {
      const auto found = camera_images[c].find(utime);
      if (found == camera_images[c].end()) continue;
      recording->images.push_back({utime, sequence, static_cast<int>(c), found->second});
    }
    ++sequence;
  }
  // Pairs that one side lacks. A listed file that is absent is such a gap too, and counts once.
  std::size_t gaps = 0;
  for (const auto& images : camera_images) gaps += utimes.size() - images.size();
  recording->missing_images = std::max(recording->missing_images, gaps);
}

void read_imu(const fs::path& folder, Recording* recording) {
  const FieldFile text(folder / "data.csv", kCommaAndBlanks);
  std::int64_t last_utime = -1;
  for (const FieldLine& line : text.lines()) {
    line.require_fields(7, "timestamp [ns],wx,wy,wz [rad/s],ax,ay,az [m/s^2]");
    last_utime = next_utime(line, last_utime);
    RecordingImu sample;
    sample.utime = last_utime;
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      sample.angular_velocity_radps[axis] = line.number_at(1 + i, "the angular velocity");
      sample.acceleration_mps2[axis] = line.number_at(4 + i, "the acceleration");
    }
    recording->imu.push_back(sample);
  }
}

void read_truth(const fs::path& file, Recording* recording) {
  const FieldFile text(file, kCommaAndBlanks);
  std::int64_t last_utime = -1;
  for (const FieldLine& line : text.lines()) {
    line.require_fields(8, "timestamp [ns],px,py,pz [m],qw,qx,qy,qz");
    last_utime = next_utime(line, last_utime);
    RecordingTruth truth;
    truth.utime = last_utime;
    truth.T_world_body.t = {line.number_at(1, "px"), line.number_at(2, "py"), line.number_at(3, "pz")};
    const Eigen::Quaterniond q(line.number_at(4, "qw"), line.number_at(5, "qx"), line.number_at(6, "qy"),
                               line.number_at(7, "qz"));
    if (std::abs(q.norm() - 1.0) > 0.01) line.fail("expected a unit quaternion qw,qx,qy,qz");
    truth.T_world_body.q = q.normalized();
    recording->truth.push_back(truth);
  }
}

fs::path find_mav0(const fs::path& root) {
  require_folder(root, "mav0, an EuRoC recording");
  if (fs::is_directory(root / "mav0" / "cam0")) return root / "mav0";
  if (fs::is_directory(root / "cam0")) return root;
  throw InputError(root.string() +
                   ": expected an EuRoC recording: a folder that holds mav0/cam0, or mav0 itself");
}

}  // namespace

Recording read_euroc(const fs::path& root, Damaged damaged) {
  const fs::path mav0 = find_mav0(root);
  Recording recording;
  recording.body_name = "imu0";
  std::vector<std::map<std::int64_t, fs::path>> images;
  for (const char* name : {"cam0", "cam1"}) {
    const fs::path folder = mav0 / name;
    if (!fs::is_directory(folder)) break;  // monocular
    std::map<std::int64_t, fs::path> list = read_image_list(folder, &recording.missing_images);
    if (list.empty() && images.empty()) {
      throw InputError((folder / "data.csv").string() + ": none of its images exists in " +
                       (folder / "data").string());
    }
    if (list.empty()) break;
    images.push_back(std::move(list));
    recording.cameras.push_back(read_camera(folder));
  }
  add_images(images, &recording);
  const auto read_imu_folder = [&] {
    const ImuCalibration calibration = read_imu_calibration(mav0 / "imu0");
    read_imu(mav0 / "imu0", &recording);
    recording.imu_calibration = calibration;
  };
  if (fs::is_directory(mav0 / "imu0")) read_sensor(damaged, read_imu_folder, &recording.imu, &recording);
  const fs::path truth = mav0 / "state_groundtruth_estimate0" / "data.csv";
  if (fs::exists(truth))
    read_sensor(
        damaged, [&] { read_truth(truth, &recording); }, &recording.truth, &recording);
  complete_cameras(mav0 / "cam0" / "sensor.yaml", &recording);
  return recording;
}

}  // namespace farpoint::tools
