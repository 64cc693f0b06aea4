// SPDX-License-Identifier: Apache-2.0
// A recording of a public data set: its sensors, and their samples in order of time. Image bytes stay in
// their files until they are copied into the log.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "daemon/config/errors.h"
#include "ipc/image_codec.h"
#include "slam/geometry/camera.h"
#include "slam/geometry/se3.h"

namespace farpoint::daemon {
struct CameraFile;
}

namespace farpoint::tools {

struct RecordingCamera {
  std::string name;
  slam::Camera::Parameters parameters;
  slam::SE3 T_body_camera;
  double rate_hz = 0.0;     // nominal; 0 unknown
  double row_time_s = 0.0;  // rolling shutter: one row to the next; 0 global; negative unknown
};

enum class RawEncoding : std::uint8_t { kNone, kGrey8, kRgb8, kBgr8, kRgba8, kBgra8, kUyvy8, kYuyv8 };
[[nodiscard]] std::size_t bytes_a_pixel(RawEncoding encoding);

// Pixels without a file format around them.
struct RawImage {
  RawEncoding encoding = RawEncoding::kNone;  // kNone: PNG or JPEG
  int width_px = 0, height_px = 0;
  std::size_t row_bytes = 0;
};

struct RecordingImage {
  std::int64_t utime = 0;
  std::int64_t sequence = 0;  // the same for images taken together
  int camera = 0;
  std::filesystem::path file;
  std::uint64_t offset = 0, bytes = 0;  // of the image in `file`; no bytes: all of it
  std::uint64_t part = 0;  // of a bag, in which `offset` counts: compressed chunk or row; 0: the file itself
  RawImage raw{};
};

struct RecordingImu {
  std::int64_t utime = 0;
  Eigen::Vector3d angular_velocity_radps = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration_mps2 = Eigen::Vector3d::Zero();  // specific force
};

struct RecordingWheels {
  std::int64_t utime = 0;
  double speed_mps = 0.0, yaw_rate_radps = 0.0;
};

struct ImuCalibration {
  slam::SE3 T_body_imu;
  double rate_hz = 0.0;
  double gyro_noise_density = 0.0, gyro_random_walk = 0.0;    // rad/s/sqrt(Hz), rad/s^2/sqrt(Hz)
  double accel_noise_density = 0.0, accel_random_walk = 0.0;  // m/s^2/sqrt(Hz), m/s^3/sqrt(Hz)
};

struct RecordingTruth {
  std::int64_t utime = 0;
  slam::SE3 T_world_body;  // world: the data set's own
};

struct Recording {
  // The body of T_body_camera and of the truth; empty if the data set names none. The body then stands at
  // camera 0 with axes x forward, y left, z up.
  std::string body_name;
  std::vector<RecordingCamera> cameras;
  std::optional<ImuCalibration> imu_calibration;
  std::vector<RecordingImage> images;   // ascending in time, camera 0 first where they are taken together
  std::vector<RecordingImu> imu;        // ascending in time
  std::vector<RecordingWheels> wheels;  // ascending in time
  std::vector<RecordingTruth> truth;    // ascending in time
  bool truth_has_orientation = true;
  std::vector<std::string> notices;  // what a person should know, a line each
  std::size_t missing_images = 0;    // listed, but without a file, or on one side of a stereo pair only
};

// Rotation of a camera that looks along the body's x axis, upright: camera z = body x, camera x = -body y.
[[nodiscard]] slam::SE3 forward_looking_T_body_camera();

// Throws InputError unless `folder` is one; `wanted` is what it should hold. Files of other recorders are
// named.
void require_folder(const std::filesystem::path& folder, const std::string& wanted);

// Adds the camera of a camera file, and the body where the file names one. Without a body the camera looks
// along the body's x axis, upright. Throws InputError naming the file.
void add_camera(const std::filesystem::path& camera_file, const std::string& name, Recording* recording);
// The same from what was read; `origin` names it in notices.
void add_camera(const daemon::CameraFile& content, const std::string& origin, const std::string& name,
                Recording* recording);

// The bytes of an image file. Throws InputError for one that a log would not hold.
[[nodiscard]] std::string read_image_file(const std::filesystem::path& file);
// Reads format and size from the header of an image file. Throws InputError naming `file`.
[[nodiscard]] ipc::ImageInfo probe_image_file(const std::string& bytes, const std::filesystem::path& file);

// By the median interval of the camera's images; 0: fewer than two.
[[nodiscard]] double median_rate_hz(const Recording& recording, int camera);
// Sets parameters.width/height of 0 from the first image of each camera, checks each camera, and fills an
// unknown rate by the median interval of the images. Throws InputError naming the file `calibration`.
void complete_cameras(const std::filesystem::path& calibration, Recording* recording);

// Whether a sensor's file that is damaged stops an import; images and their calibration always do.
enum class Damaged : std::uint8_t { kLeftOut, kRefused };

// Calls `read`, which reads a sensor's files into `samples`. Where `read` throws InputError, kLeftOut empties
// `samples` and notes the reason in the recording's notices; kRefused throws it on.
template <typename Sample>
void read_sensor(Damaged damaged, const std::function<void()>& read, std::vector<Sample>* samples,
                 Recording* recording) {
  try {
    read();
  } catch (const daemon::InputError& error) {
    if (damaged == Damaged::kRefused) throw;
    samples->clear();
    recording->notices.push_back(std::string(error.what()) + "; imported without this sensor");
  }
}

// Keeps `frames` instants of the images (0: all that follow) from number `first` on, and IMU samples and
// truth of that time and half a second on either side. Throws InputError naming `recording_name` without such
// an instant.
void keep_part(std::int64_t first, std::int64_t frames, const std::string& recording_name,
               Recording* recording);

}  // namespace farpoint::tools
