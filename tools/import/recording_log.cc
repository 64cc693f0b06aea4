// SPDX-License-Identifier: Apache-2.0
#include "tools/import/recording_log.h"

#include <algorithm>
#include <limits>
#include <memory>

#include "daemon/config/calibration_message.h"
#include "ipc/channels.h"
#include "ipc/log.h"
#include "tools/common/errors.h"
#include "tools/common/progress.h"
#include "tools/import/bag_file.h"

namespace farpoint::tools {
namespace {

// Order of messages of one time: what happened up to a frame comes before it.
enum class Kind : int { kImu = 0, kWheels = 1, kTruth = 2, kImage = 3 };

struct Event {
  std::int64_t utime;
  Kind kind;
  std::size_t index;
};

std::vector<Event> events_in_order(const Recording& recording) {
  std::vector<Event> events;
  for (std::size_t i = 0; i < recording.imu.size(); ++i)
    events.push_back({recording.imu[i].utime, Kind::kImu, i});
  for (std::size_t i = 0; i < recording.wheels.size(); ++i)
    events.push_back({recording.wheels[i].utime, Kind::kWheels, i});
  for (std::size_t i = 0; i < recording.truth.size(); ++i) {
    events.push_back({recording.truth[i].utime, Kind::kTruth, i});
  }
  for (std::size_t i = 0; i < recording.images.size(); ++i) {
    events.push_back({recording.images[i].utime, Kind::kImage, i});
  }
  std::stable_sort(events.begin(), events.end(), [](const Event& a, const Event& b) {
    return a.utime != b.utime ? a.utime < b.utime : a.kind < b.kind;
  });
  return events;
}

calibration_t calibration_message(const Recording& recording, std::int64_t utime) {
  calibration_t message{};
  message.utime = utime;
  message.body_name = recording.body_name;
  for (const RecordingCamera& camera : recording.cameras) {
    message.cameras.push_back(daemon::camera_message(camera.name, camera.parameters, camera.T_body_camera,
                                                     camera.rate_hz, camera.row_time_s));
  }
  message.ncameras = static_cast<std::int32_t>(message.cameras.size());
  message.imu_orientation[0] = 1.0;
  if (!recording.imu_calibration) return message;
  const ImuCalibration& imu = *recording.imu_calibration;
  message.has_imu = 1;
  daemon::set_pose(imu.T_body_imu, message.imu_position, message.imu_orientation);
  message.imu_rate_hz = imu.rate_hz;
  message.gyro_noise_density = imu.gyro_noise_density;
  message.gyro_random_walk = imu.gyro_random_walk;
  message.accel_noise_density = imu.accel_noise_density;
  message.accel_random_walk = imu.accel_random_walk;
  return message;
}

imu_t to_message(const RecordingImu& sample) {
  imu_t message{};
  message.utime = sample.utime;
  daemon::set_vector(sample.angular_velocity_radps, message.angular_velocity);
  daemon::set_vector(sample.acceleration_mps2, message.acceleration);
  message.temperature = std::numeric_limits<double>::quiet_NaN();
  return message;
}

ground_truth_t to_message(const RecordingTruth& truth, bool has_orientation) {
  ground_truth_t message{};
  message.utime = truth.utime;
  daemon::set_vector(truth.T_world_body.t, message.position);
  message.has_orientation = has_orientation ? 1 : 0;
  daemon::set_quaternion(has_orientation ? truth.T_world_body.q : Eigen::Quaterniond::Identity(),
                         message.orientation);
  return message;
}

wheels_t to_message(const RecordingWheels& sample) {
  wheels_t message{};
  message.utime = sample.utime;
  message.speed = sample.speed_mps;
  message.speed_sigma = -1.0;
  message.yaw_rate = sample.yaw_rate_radps;
  message.steering_angle = std::numeric_limits<double>::quiet_NaN();
  return message;
}

// Bytes of images in files. The bag that was read last stays open.
class StoredImages {
 public:
  std::string operator()(const RecordingImage& image) {
    if (image.bytes == 0) return read_image_file(image.file);
    if (bag_ == nullptr || bag_->path() != image.file) bag_ = open_bag(image.file);
    return bag_->read({image.part, image.offset}, image.bytes);
  }

 private:
  std::shared_ptr<BagFile> bag_;  // shared: an ImageSource is copied
};

// Where the image is, for errors.
std::filesystem::path name_of(const RecordingImage& image) {
  if (image.bytes == 0) return image.file;
  const std::string part = image.part == 0 ? "" : "part " + std::to_string(image.part) + ", ";
  return image.file.string() + ": " + part + "byte " + std::to_string(image.offset);
}

// A row of colour or luma samples as grey. ITU-R BT.601, as JPEG has it.
void to_grey(const RawImage& raw, const std::uint8_t* from, std::uint8_t* to) {
  const std::size_t step = bytes_a_pixel(raw.encoding);
  const bool colour = step >= 3;
  const bool red_first = raw.encoding == RawEncoding::kRgb8 || raw.encoding == RawEncoding::kRgba8;
  const std::size_t luma = raw.encoding == RawEncoding::kUyvy8 ? 1 : 0;
  for (int x = 0; x < raw.width_px; ++x, from += step) {
    const unsigned red = colour ? from[red_first ? 0 : 2] : 0, blue = colour ? from[red_first ? 2 : 0] : 0;
    to[x] = colour ? static_cast<std::uint8_t>((299 * red + 587 * from[1] + 114 * blue + 500) / 1000)
                   : from[luma];
  }
}

void set_pixels(const RecordingImage& image, const std::string& bytes, image_t* message) {
  const RawImage& raw = image.raw;
  message->width = raw.width_px;
  message->height = raw.height_px;
  message->row_stride = raw.width_px;
  message->pixel_format = image_t::PIXEL_FORMAT_GREY;
  const auto width = static_cast<std::size_t>(raw.width_px), height = static_cast<std::size_t>(raw.height_px);
  message->data.resize(width * height);
  const auto* const from = reinterpret_cast<const std::uint8_t*>(bytes.data());
  for (std::size_t y = 0; y < height; ++y)
    to_grey(raw, from + y * raw.row_bytes, message->data.data() + y * width);
}

void set_file(const RecordingImage& image, const std::string& bytes, image_t* message) {
  const ipc::ImageInfo info = probe_image_file(bytes, name_of(image));
  message->width = info.width_px;
  message->height = info.height_px;
  message->pixel_format = info.pixel_format;
  message->data.assign(bytes.begin(), bytes.end());
}

image_t to_message(const RecordingImage& image, const RecordingCamera& camera, const ImageSource& source) {
  image_t message{};
  message.utime = image.utime;
  message.sequence = image.sequence;
  message.camera = image.camera;
  message.exposure_us = -1;
  message.gain = -1.0F;
  if (image.raw.encoding == RawEncoding::kNone) {
    set_file(image, source(image), &message);
  } else {
    set_pixels(image, source(image), &message);
  }
  if (message.width != camera.parameters.width_px || message.height != camera.parameters.height_px) {
    throw InputError(name_of(image).string() + ": expected " + std::to_string(camera.parameters.width_px) +
                     "x" + std::to_string(camera.parameters.height_px) + " pixels as of camera " +
                     camera.name + ", found " + std::to_string(message.width) + "x" +
                     std::to_string(message.height));
  }
  message.size = static_cast<std::int32_t>(message.data.size());
  return message;
}

void write_event(const Recording& recording, const Event& event, const ImageSource& source,
                 ipc::LogWriter* log) {
  switch (event.kind) {
    case Kind::kImu:
      log->write_message(ipc::kImuChannel, event.utime, to_message(recording.imu[event.index]));
      return;
    case Kind::kWheels:
      log->write_message(ipc::kWheelsChannel, event.utime, to_message(recording.wheels[event.index]));
      return;
    case Kind::kTruth:
      log->write_message(ipc::kGroundTruthChannel, event.utime,
                         to_message(recording.truth[event.index], recording.truth_has_orientation));
      return;
    case Kind::kImage: {
      const RecordingImage& image = recording.images[event.index];
      const std::string channel = ipc::kCameraChannelPrefix + std::to_string(image.camera);
      const RecordingCamera& camera = recording.cameras[static_cast<std::size_t>(image.camera)];
      log->write_message(channel, event.utime, to_message(image, camera, source));
      return;
    }
  }
}

std::unique_ptr<ipc::LogWriter> open_log(const std::filesystem::path& file) {
  try {
    return std::make_unique<ipc::LogWriter>(file.string());
  } catch (const std::runtime_error& e) {
    throw InputError(e.what());  // a name that cannot be written is wrong use
  }
}

}  // namespace

void write_recording(const Recording& recording, const std::filesystem::path& log_file,
                     const ImageSource& source) {
  const std::vector<Event> events = events_in_order(recording);
  const std::unique_ptr<ipc::LogWriter> log = open_log(log_file);
  const std::int64_t first_utime = events.front().utime;  // every importer demands an image
  log->write_message(ipc::kCalibrationChannel, first_utime, calibration_message(recording, first_utime));
  const ImageSource images = source ? source : StoredImages();
  Progress progress(log_file.filename().string(), events.size());
  for (std::size_t i = 0; i < events.size(); ++i) {
    write_event(recording, events[i], images, log.get());
    if (!log->error().empty()) break;
    progress.advance(i + 1);
  }
  try {
    log->close();
  } catch (const std::runtime_error& e) {
    throw RunError(e.what());
  }
}

}  // namespace farpoint::tools
