// SPDX-License-Identifier: Apache-2.0
#include "daemon/config/rig.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace farpoint::daemon {
namespace {

constexpr double kBytesPerMb = 1e6;

[[noreturn]] void refuse(int camera_index, const std::string& why) {
  throw InputError(fmt::format("CALIBRATION, camera {}: {}", camera_index, why));
}

slam::CameraModel model_of(const camera_calibration_t& camera, int camera_index) {
  if (camera.model == "pinhole-radtan") return slam::CameraModel::kPinholeRadtan;
  if (camera.model == "kannala-brandt") return slam::CameraModel::kKannalaBrandt;
  refuse(camera_index, "model '" + camera.model + "', expected 'pinhole-radtan' or 'kannala-brandt'");
}

slam::SE3 pose_of(const camera_calibration_t& camera, int camera_index) {
  const Eigen::Quaterniond q(camera.orientation[0], camera.orientation[1], camera.orientation[2],
                             camera.orientation[3]);
  const Eigen::Vector3d t(camera.position[0], camera.position[1], camera.position[2]);
  // Data sets give rotation matrices with few digits: allow their rounding, not more.
  constexpr double kNormTolerance = 1e-3;
  if (!t.allFinite() || !(std::abs(q.norm() - 1.0) < kNormTolerance)) {
    refuse(camera_index,
           "T_body_camera is no rigid motion, expected a finite position and a unit quaternion");
  }
  return {q.normalized(), t};
}

slam::Camera camera_of(const camera_calibration_t& camera, int camera_index) {
  slam::Camera::Parameters p;
  p.model = model_of(camera, camera_index);
  p.width_px = camera.width;
  p.height_px = camera.height;
  p.fx_px = camera.fx;
  p.fy_px = camera.fy;
  p.cx_px = camera.cx;
  p.cy_px = camera.cy;
  std::copy(std::begin(camera.distortion), std::end(camera.distortion), p.distortion.begin());
  const std::string problem = slam::Camera::check(p);
  if (!problem.empty()) refuse(camera_index, problem);
  return slam::Camera(p);
}

// Bytes of one pyramid a pixel of the image.
double pyramid_share(const slam::PyramidOptions& options) {
  double share = 0.0;
  for (int level = 0; level < options.levels; ++level) share += std::pow(options.scale_factor, -2.0 * level);
  return share;
}

// As slam/frame_intake.cc counts them; a test compares the two.
double pyramids(const slam::EstimatorConfig& config) {
  constexpr double kHistoryFrames = 60.0, kCandidateSpacing_s = 0.2, kInUse = 8.0;
  const double looking =
      std::min(0.5 * config.initialisation.max_age_s / kCandidateSpacing_s, kHistoryFrames) + 4.0;
  return std::max(looking, config.capacity.window_images + 3.0) + kInUse;
}

}  // namespace

double image_bytes(const Config& config, std::int64_t pixels) {
  // Corners of all levels before selection, a blurred level, the grids of frames, images on their way.
  constexpr double kBytesBesidePyramids = 16.0;
  const double a_pixel =
      pyramid_share(config.estimator.pyramid) * pyramids(config.estimator) + kBytesBesidePyramids;
  return a_pixel * static_cast<double>(pixels);
}

std::int64_t most_image_pixels(const Config& config) {
  return static_cast<std::int64_t>(config.image_mb * kBytesPerMb / image_bytes(config, 1));
}

namespace {

void check_image_size_of(const calibration_t& calibration, const Config& config, int index) {
  const camera_calibration_t& camera = calibration.cameras[static_cast<std::size_t>(index)];
  if (camera.width <= 0 || camera.height <= 0) return;
  const std::int64_t pixels = std::int64_t{camera.width} * camera.height;
  if (pixels <= most_image_pixels(config)) return;
  refuse(index, fmt::format(
                    "images of {} x {} need {:.0f} MB with capacity.window_images {}, expected at most {} MB "
                    "(capacity.image_mb)",
                    camera.width, camera.height, std::ceil(image_bytes(config, pixels) / kBytesPerMb),
                    config.estimator.capacity.window_images, config.image_mb));
}

}  // namespace

void check_image_size(const calibration_t& calibration, const Config& config) {
  const int index = config.camera.index;
  if (index >= static_cast<int>(calibration.cameras.size())) return;  // make_rig() refuses it
  check_image_size_of(calibration, config, index);
  if (const std::optional<int> second = second_camera(calibration, config.camera))
    check_image_size_of(calibration, config, *second);
}

slam::Rig make_rig(const calibration_t& calibration, int camera_index) {
  const int cameras = static_cast<int>(calibration.cameras.size());
  if (camera_index >= cameras) {
    throw InputError(fmt::format("CALIBRATION: {} cameras, expected camera {} (key camera.index) among them",
                                 cameras, camera_index));
  }
  const camera_calibration_t& camera = calibration.cameras[static_cast<std::size_t>(camera_index)];
  slam::Rig rig;
  rig.cameras.push_back({camera.name, camera_of(camera, camera_index), pose_of(camera, camera_index)});
  return rig;
}

std::optional<int> second_camera(const calibration_t& calibration, const CameraConfig& config) {
  // Nearer than that, two cameras show one picture: no depth.
  constexpr double kLeastBaseline_m = 0.005;
  const int cameras = static_cast<int>(calibration.cameras.size());
  if (config.use == CameraUse::kOne || config.index >= cameras) return {};
  const slam::SE3 T_body_first = make_rig(calibration, config.index).cameras.front().T_body_camera;
  for (int i = 0; i < cameras; ++i) {
    if (i == config.index) continue;
    const slam::SE3 T_body_camera = make_rig(calibration, i).cameras.front().T_body_camera;
    if ((T_body_camera.t - T_body_first.t).norm() >= kLeastBaseline_m) return i;
  }
  return {};
}

slam::Rig make_rig(const calibration_t& calibration, const CameraConfig& config) {
  slam::Rig rig = make_rig(calibration, config.index);
  if (const std::optional<int> second = second_camera(calibration, config))
    rig.cameras.push_back(make_rig(calibration, *second).cameras.front());
  return rig;
}

std::string calibration_hash(const calibration_t& calibration) {
  calibration_t timeless = calibration;
  timeless.utime = 0;
  std::vector<std::uint8_t> bytes;
  ipc::encode(timeless, &bytes);
  return fmt::format("{:016x}", fnv1a_64(std::string(bytes.begin(), bytes.end())));
}

}  // namespace farpoint::daemon
