// SPDX-License-Identifier: Apache-2.0
#include "tools/import/kitti.h"

#include <Eigen/LU>
#include <algorithm>
#include <map>

#include "daemon/config/yaml_file.h"
#include "tools/common/errors.h"
#include "tools/common/numbers.h"
#include "tools/common/text_file.h"

namespace farpoint::tools {

using daemon::to_rigid_motion;
namespace {

namespace fs = std::filesystem;
using Projection = Eigen::Matrix<double, 3, 4>;

constexpr std::int64_t kDefaultInterval_us = 100'000;
constexpr std::string_view kProjectionLayout = "P0: and 12 numbers, a 3x4 matrix by rows";

// Image number -> file, from names like 000123.png.
std::map<std::int64_t, fs::path> list_images(const fs::path& folder) {
  std::map<std::int64_t, fs::path> images;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".png" && extension != ".jpg" && extension != ".jpeg") continue;
    const std::int64_t number = whole_number(entry.path().stem().string()).value_or(-1);
    if (number < 0) {
      throw InputError(entry.path().string() + ": expected an image named by its number, like 000000" +
                       extension);
    }
    if (!images.emplace(number, entry.path()).second) {
      throw InputError(entry.path().string() + ": a second image of number " + std::to_string(number));
    }
  }
  return images;
}

Projection read_projection(const FieldLine& line) {
  line.require_fields(13, kProjectionLayout);
  Projection p;
  for (int i = 0; i < 12; ++i)
    p(i / 4, i % 4) = line.number_at(static_cast<std::size_t>(i) + 1, "the projection");
  const bool rectified = p(0, 1) == 0.0 && p(1, 0) == 0.0 && p(2, 0) == 0.0 && p(2, 1) == 0.0 &&
                         p(2, 2) == 1.0 && p(0, 0) > 0.0 && p(1, 1) > 0.0;
  if (!rectified) line.fail("expected the projection of a rectified camera: fx 0 cx . / 0 fy cy . / 0 0 1 .");
  return p;
}

std::map<std::string, Projection> read_projections(const fs::path& file) {
  const FieldFile text(file, kBlanks);
  std::map<std::string, Projection> projections;
  for (const FieldLine& line : text.lines()) {
    const std::string label(line.text(0));
    if (label == "P0:" || label == "P1:") projections[label] = read_projection(line);
  }
  return projections;
}

// Where a rectified camera stands in the axes that all projections share: p_camera = p + K^-1 P.col(3).
Eigen::Vector3d camera_centre(const Projection& p) {
  return -p.leftCols<3>().inverse() * p.col(3);
}

RecordingCamera make_camera(const std::string& name, const Projection& p, const Projection& p0) {
  RecordingCamera camera;
  camera.name = name;
  camera.parameters.fx_px = p(0, 0);
  camera.parameters.fy_px = p(1, 1);
  camera.parameters.cx_px = p(0, 2);
  camera.parameters.cy_px = p(1, 2);
  const slam::SE3 T_camera0_camera{Eigen::Quaterniond::Identity(), camera_centre(p) - camera_centre(p0)};
  camera.T_body_camera = forward_looking_T_body_camera() * T_camera0_camera;
  return camera;
}

std::vector<RecordingCamera> read_cameras(const fs::path& calibration, bool stereo) {
  const std::map<std::string, Projection> projections = read_projections(calibration);
  std::vector<RecordingCamera> cameras;
  for (int c = 0; c < (stereo ? 2 : 1); ++c) {
    const std::string label = c == 0 ? "P0:" : "P1:";
    const auto found = projections.find(label);
    if (found == projections.end()) {
      throw InputError(calibration.string() + ": line '" + label + "' is missing, expected " +
                       std::string(kProjectionLayout) + (c == 1 ? " (there is an image_1)" : ""));
    }
    cameras.push_back(make_camera("image_" + std::to_string(c), found->second, projections.at("P0:")));
  }
  return cameras;
}

std::vector<std::int64_t> read_times(const fs::path& file) {
  const FieldFile text(file, kBlanks);
  std::vector<std::int64_t> utimes;
  for (const FieldLine& line : text.lines()) {
    utimes.push_back(line.utime_from_seconds_at(0, "the image's time"));
    if (utimes.size() > 1 && utimes.back() <= utimes[utimes.size() - 2]) {
      line.fail("expected a time after the one above, found '" + std::string(line.text(0)) + "'");
    }
  }
  return utimes;
}

// Times of the image numbers 0 .. count-1.
std::vector<std::int64_t> image_times(const fs::path& folder, std::int64_t count) {
  const fs::path file = folder / "times.txt";
  std::vector<std::int64_t> utimes;
  if (fs::exists(file)) {
    utimes = read_times(file);
    if (static_cast<std::int64_t>(utimes.size()) < count) {
      throw InputError(file.string() + ": " + std::to_string(utimes.size()) + " times, expected at least " +
                       std::to_string(count) + ", one for each image number");
    }
    return utimes;
  }
  for (std::int64_t i = 0; i < count; ++i) utimes.push_back(i * kDefaultInterval_us);
  return utimes;
}

// camera_images[c]: number -> file. Frames in ascending number, camera 0 first.
void add_images(const std::vector<std::map<std::int64_t, fs::path>>& camera_images,
                const std::vector<std::int64_t>& utimes, Recording* recording) {
  const std::int64_t first = camera_images[0].begin()->first;
  const std::int64_t last = camera_images[0].rbegin()->first;
  for (std::int64_t number = first; number <= last; ++number) {
    for (std::size_t c = 0; c < camera_images.size(); ++c) {
      const auto found = camera_images[c].find(number);
      if (found == camera_images[c].end()) {
        ++recording->missing_images;
        continue;
      }
      recording->images.push_back(
          {utimes[static_cast<std::size_t>(number)], number, static_cast<int>(c), found->second});
    }
  }
}

void read_poses(const fs::path& file, const std::vector<std::int64_t>& utimes, Recording* recording) {
  const FieldFile text(file, kBlanks);
  const slam::SE3 T_camera_body = recording->cameras[0].T_body_camera.inverse();
  for (std::size_t i = 0; i < std::min(text.lines().size(), utimes.size()); ++i) {
    const FieldLine& line = text.lines()[i];
    line.require_fields(12, "a 3x4 pose matrix by rows");
    Projection matrix;
    for (int k = 0; k < 12; ++k)
      matrix(k / 4, k % 4) = line.number_at(static_cast<std::size_t>(k), "the pose");
    slam::SE3 T_world_camera;
    if (!to_rigid_motion(matrix, &T_world_camera))
      line.fail("expected a rotation (orthonormal, determinant +1) in the pose");
    recording->truth.push_back({utimes[i], T_world_camera * T_camera_body});
  }
}

void read_gps(const fs::path& file, Recording* recording) {
  const FieldFile text(file, kBlanks);
  recording->truth_has_orientation = false;
  for (const FieldLine& line : text.lines()) {
    line.require_fields(3, "seconds east north");
    RecordingTruth truth;
    truth.utime = line.utime_from_seconds_at(0, "the position's time");
    truth.T_world_body.t = {line.number_at(1, "east"), line.number_at(2, "north"), 0.0};
    if (!recording->truth.empty() && truth.utime <= recording->truth.back().utime) {
      line.fail("expected a time after the one above, found '" + std::string(line.text(0)) + "'");
    }
    recording->truth.push_back(truth);
  }
}

void read_wheels(const fs::path& file, Recording* recording) {
  const FieldFile text(file, kCommaAndBlanks);
  for (const FieldLine& line : text.lines()) {
    line.require_fields(3, "seconds,speed_mps,yaw_rate_rad_per_s");
    const RecordingWheels sample{line.utime_from_seconds_at(0, "the sample's time"),
                                 line.number_at(1, "the speed"), line.number_at(2, "the yaw rate")};
    if (!recording->wheels.empty() && sample.utime <= recording->wheels.back().utime) {
      line.fail("expected a time after the one above, found '" + std::string(line.text(0)) + "'");
    }
    recording->wheels.push_back(sample);
  }
}

// Names of the sequences that exist, for an error.
std::string sequences_of(const fs::path& root) {
  constexpr std::size_t kMostShown = 30;
  std::vector<std::string> names;
  if (fs::is_directory(root / "sequences")) {
    for (const fs::directory_entry& entry : fs::directory_iterator(root / "sequences"))
      if (entry.is_directory()) names.push_back(entry.path().filename().string());
  }
  if (names.empty()) return "DIR/sequences/SEQUENCE";
  std::sort(names.begin(), names.end());
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kMostShown); ++i)
    text += (i == 0 ? "" : ", ") + names[i];
  return text +
         (names.size() > kMostShown ? " and " + std::to_string(names.size() - kMostShown) + " more" : "");
}

}  // namespace

Recording read_kitti(const fs::path& root, const std::string& sequence, Damaged damaged) {
  const fs::path folder = root / "sequences" / sequence;
  require_folder(root, "'sequences', a KITTI recording");
  if (!fs::is_directory(folder)) {
    throw InputError(folder.string() + ": no such folder, expected one of " + sequences_of(root));
  }
  if (!fs::is_directory(folder / "image_0"))
    throw InputError((folder / "image_0").string() + ": no such folder");

  std::vector<std::map<std::int64_t, fs::path>> images{list_images(folder / "image_0")};
  if (images[0].empty()) throw InputError((folder / "image_0").string() + ": no PNG or JPEG images");
  if (fs::is_directory(folder / "image_1")) {
    std::map<std::int64_t, fs::path> right = list_images(folder / "image_1");
    if (!right.empty()) images.push_back(std::move(right));
  }

  Recording recording;
  recording.cameras = read_cameras(folder / "calib.txt", images.size() == 2);
  const std::vector<std::int64_t> utimes = image_times(folder, images[0].rbegin()->first + 1);
  add_images(images, utimes, &recording);
  const fs::path poses = root / "poses" / (sequence + ".txt");
  const auto read_truth = [&] {
    if (fs::exists(poses)) {
      read_poses(poses, utimes, &recording);
    } else if (fs::exists(folder / "gps_xy.txt")) {
      read_gps(folder / "gps_xy.txt", &recording);
    }
  };
  read_sensor(damaged, read_truth, &recording.truth, &recording);
  if (const fs::path wheels = folder / "wheels.csv"; fs::exists(wheels))
    read_sensor(
        damaged, [&] { read_wheels(wheels, &recording); }, &recording.wheels, &recording);
  complete_cameras(folder / "calib.txt", &recording);
  return recording;
}

}  // namespace farpoint::tools
