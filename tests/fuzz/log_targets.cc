// SPDX-License-Identifier: Apache-2.0
// A recorded log through the checks of drivers/log, and single messages through their decoders.
#include <array>
#include <cmath>
#include <type_traits>

#include "daemon/config/errors.h"
#include "daemon/config/rig.h"
#include "drivers/log/log_source.h"
#include "ipc/channels.h"
#include "ipc/file_kind.h"
#include "tests/daemon/synthetic_log.h"
#include "tests/fuzz/composed_log.h"
#include "tests/fuzz/memory_file.h"
#include "tests/fuzz/small_images.h"

namespace farpoint::fuzz {
namespace {

constexpr std::int64_t kMostPixels = 64 * 1024;

void check_image(drivers::LogSource* source, const drivers::LogItem& item, ipc::GreyImage* image) {
  require(item.image != nullptr && item.camera >= 0 && item.camera < drivers::LogSource::kMaxCameras,
          "an image comes with its camera");
  if (source->decode(item, image) != ipc::ImageStatus::kOk) return;
  require(image->width_px == item.image->width && image->height_px == item.image->height,
          "the image has the size of its message");
  require(std::int64_t{image->width_px} * image->height_px <= kMostPixels,
          "no image is larger than the limit");
}

void check_calibration(const calibration_t& calibration) {
  daemon::Config config;
  try {
    daemon::check_image_size(calibration, config);
    const slam::Rig rig = daemon::make_rig(calibration, config.camera.index);
    require(!rig.cameras.empty(), "a rig has cameras");
    (void)daemon::calibration_hash(calibration);
  } catch (const daemon::InputError&) {  // refused
  }
}

void read_log(const std::string& path, int only_camera) {
  drivers::LogSource source(path, kMostPixels, only_camera);
  drivers::LogItem item;
  ipc::GreyImage image;
  std::int64_t last = INT64_MIN;
  while (source.next(&item)) {
    if (item.kind == drivers::LogItemKind::kImage) check_image(&source, item, &image);
    if (item.kind == drivers::LogItemKind::kCalibration) check_calibration(*item.calibration);
    if (item.kind == drivers::LogItemKind::kImu) {
      require(item.utime > last, "times of the IMU rise");
      last = item.utime;
      for (const double a : item.imu->acceleration) require(std::isfinite(a), "accelerations are finite");
    }
  }
}

template <typename... Messages>
struct Types {};
using AllTypes =
    Types<calibration_t, ground_truth_t, image_t, imu_t, landmarks_t, map_from_odom_t, map_t, odometry_t,
          pose_t, schedule_t, simulation_t, status_t, summary_t, timing_t, trajectory_t, wheels_t>;

template <typename Message>
void decode_one(ByteView payload) {
  Bytes data;
  const auto fingerprint = static_cast<std::uint64_t>(Message::getHash());
  for (int shift = 56; shift >= 0; shift -= 8)
    data.push_back(static_cast<std::uint8_t>(fingerprint >> shift));
  data.insert(data.end(), payload.begin(), payload.end());
  Message message;
  if (!ipc::decode(data, &message)) return;
  Bytes again;
  ipc::encode(message, &again);
  require(again == data, "a decoded message is encoded to the same bytes");
}

template <typename... Messages>
void decode_chosen(std::uint8_t which, ByteView payload, Types<Messages...>) {
  using Decode = void (*)(ByteView);
  constexpr std::array<Decode, sizeof...(Messages)> kDecoders = {decode_one<Messages>...};
  kDecoders[which % kDecoders.size()](payload);
}

}  // namespace

void run_log(ByteView input) {
  const MemoryFile log(log_of(input));
  if (!ipc::wrong_kind(log.path(), "an LCM log").empty()) return;  // refused when it is opened
  read_log(log.path(), drivers::LogSource::kAllCameras);
  read_log(log.path(), 0);
}

void run_message(ByteView input) {
  if (!input.empty()) decode_chosen(input[0], input.subspan(1), AllTypes{});
}

std::vector<Bytes> seeds_of_log() {
  EventList events;
  calibration_t calibration = test::synthetic_calibration();
  camera_calibration_t& camera = calibration.cameras.front();
  camera.width = kSmallWidth_px;
  camera.height = kSmallHeight_px;
  camera.cx = camera.cy = 8.0;
  events.add(ipc::kCalibrationChannel, calibration);
  std::int64_t utime = 0;
  for (const image_t& small : small_images()) {
    image_t image = small;
    image.utime = utime += 100'000;
    events.add("CAMERA_0", image);
    imu_t imu{};
    imu.utime = utime;
    events.add(ipc::kImuChannel, imu);
  }
  wheels_t wheels{};
  wheels.nwheels = 2;
  wheels.wheel_speed = {1.0, 2.0};
  events.add(ipc::kWheelsChannel, wheels);
  ground_truth_t truth{};
  truth.has_orientation = 1;
  truth.orientation[0] = 1.0;
  events.add(ipc::kGroundTruthChannel, truth);
  Bytes raw = log_of(events.input());
  raw.insert(raw.begin(), 'R');
  return {events.input(), raw};
}

std::vector<Bytes> seeds_of_message() {
  std::vector<Bytes> seeds;
  const auto add = [&](std::uint8_t which, const auto& message) {
    Bytes encoded;
    ipc::encode(message, &encoded);
    encoded.erase(encoded.begin(), encoded.begin() + 7);
    encoded.front() = which;
    seeds.push_back(std::move(encoded));
  };
  add(0, test::synthetic_calibration());
  add(2, small_images().front());
  landmarks_t landmarks{};
  landmarks.nlandmarks = 1;
  landmarks.landmarks.resize(1);
  landmarks.landmarks[0].nsightings = 1;
  landmarks.landmarks[0].sighting_utime = {1};
  landmarks.landmarks[0].sighting_u = landmarks.landmarks[0].sighting_v = {2.0F};
  add(4, landmarks);
  simulation_t simulation{};
  simulation.world = "a: 1";
  add(10, simulation);
  add(11, status_t{});
  add(12, summary_t{});
  return seeds;
}

}  // namespace farpoint::fuzz
