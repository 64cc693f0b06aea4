// SPDX-License-Identifier: Apache-2.0
#include "drivers/log/log_source.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "ipc/channels.h"

namespace farpoint::drivers {
namespace {

// No vehicle's sensor measures more; a damaged message does.
constexpr double kMaxAngularVelocity_rad_s = 200.0;
constexpr double kMaxAcceleration_m_s2 = 2000.0;
constexpr double kUnitTolerance = 0.01;

bool all_below(std::span<const double> values, double limit) {
  return std::all_of(values.begin(), values.end(),
                     [limit](double v) { return std::abs(v) <= limit; });  // NaN: false
}

bool all_finite(std::span<const double> values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

bool is_unit_quaternion(std::span<const double> q) {
  double squared = 0;
  for (const double v : q) squared += v * v;
  return std::abs(std::sqrt(squared) - 1.0) <= kUnitTolerance;  // NaN: false
}

// The N of CAMERA_N; negative for other channels.
int camera_of(std::string_view channel) {
  const std::string_view prefix = ipc::kCameraChannelPrefix;
  if (!channel.starts_with(prefix)) return -1;
  const std::string_view digits = channel.substr(prefix.size());
  int camera = -1;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), camera);
  return error == std::errc{} && end == digits.data() + digits.size() ? camera : -1;
}

// Between two times, the later one second; the longest there is where it does not fit.
std::int64_t step_us(std::int64_t from, std::int64_t to) {
  const std::uint64_t step = static_cast<std::uint64_t>(to) - static_cast<std::uint64_t>(from);
  constexpr std::int64_t kLongest_us = std::numeric_limits<std::int64_t>::max() / 4;
  return static_cast<std::int64_t>(std::min(step, static_cast<std::uint64_t>(kLongest_us)));
}

constexpr std::size_t kImageBytesAPixel = 2;

// Largest image message: two bytes a pixel and its header.
std::size_t most_image_bytes(std::int64_t most_pixels) {
  constexpr std::size_t kHeader = std::size_t{64} << 10;
  return kImageBytesAPixel * static_cast<std::size_t>(std::max<std::int64_t>(most_pixels, 0)) + kHeader;
}

// Largest event of a recording.
std::size_t most_event_bytes(std::int64_t most_pixels) {
  constexpr std::size_t kOtherMessages = std::size_t{8} << 20;
  return std::clamp(most_image_bytes(most_pixels), kOtherMessages, ipc::LogReader::kMaxDataBytes);
}

// The image's fields without its data; *to keeps its own memory.
void copy_without_data(image_t* from, image_t* to) {
  std::vector<std::uint8_t> of_from, of_to;
  of_from.swap(from->data);
  of_to.swap(to->data);
  *to = *from;
  from->data.swap(of_from);
  of_to.clear();
  to->data.swap(of_to);
}

}  // namespace

LogSource::LogSource(const std::string& path, std::int64_t most_pixels, int only_camera)
    : most_pixels_(most_pixels),
      only_camera_(only_camera),
      reader_(path, most_event_bytes(most_pixels)),
      decoder_(most_pixels) {}

bool LogSource::next(LogItem* item) {
  *item = {};
  if (const int camera = std::exchange(waiting_camera_, -1); camera >= 0)
    if (judge_image(camera, waiting_offset_, item)) return true;
  ipc::LogEvent event;
  while (reader_.next(&event)) {
    *item = {};
    item->offset = event.offset;
    if (take(event, item)) return true;
  }
  *item = {};
  return give_held_at_end(item);
}

bool LogSource::take(const ipc::LogEvent& event, LogItem* item) {
  if (const int camera = camera_of(event.channel); camera >= 0) return take_image(camera, event, item);
  if (event.channel == ipc::kImuChannel) return take_imu(event, item);
  if (event.channel == ipc::kWheelsChannel) return take_wheels(event, item);
  if (event.channel == ipc::kCalibrationChannel) return take_calibration(event, item);
  if (event.channel == ipc::kGroundTruthChannel) return take_ground_truth(event, item);
  ++counts_.others;
  return false;
}

template <typename Message>
bool LogSource::decode_message(const ipc::LogEvent& event, Message* message) {
  if (ipc::decode(event.data, message)) return true;
  ++counts_.messages_undecodable;
  return false;
}

// True where the stream may go on with this time.
bool LogSource::accept_time(std::int64_t utime, bool check_leap, Stream* stream) {
  const bool is_later = stream->last == Stream::kNone || utime > stream->last;
  const bool leaps =
      check_leap && stream->last != Stream::kNone && is_later && step_us(stream->last, utime) > kMaxLeap_us;
  const bool borne_out = stream->doubtful != Stream::kNone && utime > stream->doubtful;
  if (!is_later || (leaps && !borne_out)) {
    stream->doubtful = leaps ? utime : Stream::kNone;
    ++counts_.times_backwards;
    return false;
  }
  stream->last = utime;
  stream->doubtful = Stream::kNone;
  return true;
}

void LogSource::move_image(int camera, image_t* from, image_t* to) const {
  if (only_camera_ == kAllCameras || camera == only_camera_)
    std::swap(*from, *to);
  else
    copy_without_data(from, to);
}

bool LogSource::take_image(int camera, const ipc::LogEvent& event, LogItem* item) {
  if (event.data.size() > most_image_bytes(most_pixels_)) {
    ++counts_.images_wrong_size;
    return false;
  }
  if (!decode_message(event, &image_)) return false;
  const bool calibrated = !has_calibration_ || camera < calibration_.ncameras;
  if (camera >= kMaxCameras || camera != image_.camera || !calibrated) {
    ++counts_.images_unknown_camera;
    return false;
  }
  if (has_calibration_) {
    const camera_calibration_t& expected = calibration_.cameras[static_cast<std::size_t>(camera)];
    if (image_.width != expected.width || image_.height != expected.height) {
      ++counts_.images_wrong_size;
      return false;
    }
  }
  return judge_image(camera, event.offset, item);
}

// Gives image_ out, or the held one before it, or nothing.
bool LogSource::judge_image(int camera, std::uint64_t offset, LogItem* item) {
  CameraStream& s = camera_streams_[static_cast<std::size_t>(camera)];
  const std::int64_t utime = image_.utime;
  if (s.last != Stream::kNone && utime <= s.last) {
    ++counts_.times_backwards;
    return false;
  }
  if (s.holds && utime >= s.held.utime) {
    s.holds = false;
    if (utime == s.held.utime) {
      ++counts_.times_backwards;  // the same time again confirms it too
    } else {
      waiting_camera_ = camera;
      waiting_offset_ = offset;
    }
    give_image(&s.held, camera, s.held_offset, item);
    return true;
  }
  if (std::exchange(s.holds, false)) ++counts_.times_backwards;
  if (s.pace_us == 0 || step_us(s.last, utime) > s.pace_us + s.pace_us / 2) {
    move_image(camera, &image_, &s.held);
    s.held_offset = offset;
    s.holds = true;
    return false;
  }
  give_image(&image_, camera, offset, item);
  return true;
}

void LogSource::give_image(image_t* image, int camera, std::uint64_t offset, LogItem* item) {
  CameraStream& s = camera_streams_[static_cast<std::size_t>(camera)];
  move_image(camera, image, &given_);
  if (s.last != Stream::kNone) {
    // A slower pace shows itself at once, a gap is none.
    const std::int64_t step = step_us(s.last, given_.utime);
    s.pace_us = s.pace_us == 0 ? step : std::clamp(step, s.pace_us * 7 / 8, s.pace_us * 2);
  }
  s.last = given_.utime;
  ++counts_.images;
  item->kind = LogItemKind::kImage;
  item->utime = given_.utime;
  item->offset = offset;
  item->camera = camera;
  item->image = &given_;
}

// A held image that no later one can confirm.
bool LogSource::give_held_at_end(LogItem* item) {
  for (int camera = 0; camera < kMaxCameras; ++camera) {
    CameraStream& s = camera_streams_[static_cast<std::size_t>(camera)];
    if (!std::exchange(s.holds, false)) continue;
    if (s.last == Stream::kNone || step_us(s.last, s.held.utime) <= kMaxLeap_us) {
      give_image(&s.held, camera, s.held_offset, item);
      return true;
    }
    ++counts_.times_backwards;
  }
  return false;
}

bool LogSource::take_imu(const ipc::LogEvent& event, LogItem* item) {
  if (!decode_message(event, &imu_)) return false;
  if (!all_below(imu_.angular_velocity, kMaxAngularVelocity_rad_s) ||
      !all_below(imu_.acceleration, kMaxAcceleration_m_s2)) {
    ++counts_.imu_invalid;
    return false;
  }
  if (!accept_time(imu_.utime, true, &imu_stream_)) return false;
  ++counts_.imu;
  item->kind = LogItemKind::kImu;
  item->utime = imu_.utime;
  item->imu = &imu_;
  return true;
}

bool LogSource::take_wheels(const ipc::LogEvent& event, LogItem* item) {
  if (!decode_message(event, &wheels_)) return false;
  const auto wheels = std::span(wheels_.wheel_speed).first(static_cast<std::size_t>(wheels_.nwheels));
  const bool infinite = std::isinf(wheels_.speed) || std::isinf(wheels_.yaw_rate) ||
                        std::isinf(wheels_.steering_angle) || !std::isfinite(wheels_.speed_sigma) ||
                        std::any_of(wheels.begin(), wheels.end(), [](double v) { return std::isinf(v); });
  if (infinite) {
    ++counts_.wheels_invalid;
    return false;
  }
  if (!accept_time(wheels_.utime, false, &wheels_stream_)) return false;
  ++counts_.wheels;
  item->kind = LogItemKind::kWheels;
  item->utime = wheels_.utime;
  item->wheels = &wheels_;
  return true;
}

bool LogSource::take_calibration(const ipc::LogEvent& event, LogItem* item) {
  calibration_t calibration{};  // a damaged one must not spoil the one that holds
  if (!decode_message(event, &calibration)) return false;
  calibration_ = std::move(calibration);
  has_calibration_ = true;
  reserve_images();
  ++counts_.calibrations;
  item->kind = LogItemKind::kCalibration;
  item->utime = calibration_.utime;
  item->calibration = &calibration_;
  return true;
}

// Makes room so that no image of usual size makes a message's buffer grow later.
void LogSource::reserve_images() {
  constexpr std::int64_t kMostReserved = std::int64_t{8} << 20;
  std::size_t most = 0;
  for (std::size_t c = 0; c < std::min(calibration_.cameras.size(), camera_streams_.size()); ++c) {
    const camera_calibration_t& camera = calibration_.cameras[c];
    if (only_camera_ != kAllCameras && static_cast<int>(c) != only_camera_) continue;
    const std::int64_t pixels = std::int64_t{std::max(camera.width, 0)} * std::max(camera.height, 0);
    const auto bytes = static_cast<std::size_t>(std::min({pixels, most_pixels_, kMostReserved}));
    camera_streams_[c].held.data.reserve(bytes);
    most = std::max(most, bytes);
  }
  // The buffers change places, so all are as large as the largest.
  for (image_t* image : {&image_, &given_}) image->data.reserve(most);
}

bool LogSource::take_ground_truth(const ipc::LogEvent& event, LogItem* item) {
  if (!decode_message(event, &ground_truth_)) return false;
  const bool has_rotation = !ground_truth_.has_orientation || is_unit_quaternion(ground_truth_.orientation);
  if (!all_finite(ground_truth_.position) || !has_rotation) {
    ++counts_.ground_truths_invalid;
    return false;
  }
  if (!accept_time(ground_truth_.utime, false, &ground_truth_stream_)) return false;
  ++counts_.ground_truths;
  item->kind = LogItemKind::kGroundTruth;
  item->utime = ground_truth_.utime;
  item->ground_truth = &ground_truth_;
  return true;
}

ipc::ImageStatus LogSource::decode(const LogItem& item, ipc::GreyImage* image) {
  const ipc::ImageStatus status = decoder_.decode(*item.image, image);
  if (status == ipc::ImageStatus::kWrongSize) ++counts_.images_wrong_size;
  if (status == ipc::ImageStatus::kDamaged || status == ipc::ImageStatus::kUnknownFormat ||
      status == ipc::ImageStatus::kTooLarge)
    ++counts_.images_undecodable;
  return status;
}

}  // namespace farpoint::drivers
