// SPDX-License-Identifier: Apache-2.0
#include "tools/import/ros_message.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "ipc/image_codec.h"

namespace farpoint::tools {
namespace {

static_assert(std::endian::native == std::endian::little, "messages are little-endian");

constexpr std::size_t kMaxTextBytes = 256;
constexpr std::uint64_t kMaxImageBytes = (std::uint64_t{64} << 20) - 1024;
constexpr std::int64_t kNanoseconds = 1'000'000'000;

std::int64_t utime_of(std::int64_t seconds, std::int64_t nanoseconds) {
  return (seconds * kNanoseconds + nanoseconds + 500) / 1000;
}

template <std::size_t N>
std::array<double, N> numbers(RosFields* fields) {
  std::array<double, N> values{};
  for (double& value : values) value = fields->f64();
  return values;
}

bool all_finite(std::span<const double> values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

std::string list_text(std::span<const double> values) {
  std::string text = "[";
  for (const double value : values) {
    std::array<char, 40> number{};
    const int length = std::snprintf(number.data(), number.size(), "%.17g", value);
    text.append(text.size() > 1 ? ", " : "").append(number.data(), static_cast<std::size_t>(length));
  }
  return text + "]";
}

// Text between the quotes of a YAML file.
std::string quotable(std::string_view text) {
  std::string result(text);
  for (char& c : result)
    if (c < ' ' || c > '~' || c == '"' || c == '\\') c = '?';
  return result;
}

std::optional<RosTwist> twist_of(RosFields* fields, std::int64_t utime) {
  const std::array<double, 6> twist = numbers<6>(fields);
  if (!fields->ok() || !std::isfinite(twist[0]) || !std::isfinite(twist[5])) return {};
  return RosTwist{utime, twist[0], twist[5]};
}

}  // namespace

RosFields::RosFields(std::span<const std::uint8_t> message, RosPacking packing)
    : message_(message), packing_(packing) {
  if (packing_ == RosPacking::kRos1) return;
  // CDR: two bytes of the encoding, two of options. Only little-endian plain CDR is written by ROS 2.
  constexpr std::size_t kEncapsulation = 4;
  ok_ = message_.size() >= kEncapsulation && message_[0] == 0 && message_[1] == 1;
  begin_ = at_ = kEncapsulation;
}

bool RosFields::take(std::size_t bytes, std::size_t alignment) {
  const std::size_t gap =
      packing_ == RosPacking::kCdr ? (alignment - (at_ - begin_) % alignment) % alignment : 0;
  if (!ok_ || message_.size() < at_ || message_.size() - at_ < gap || message_.size() - at_ - gap < bytes) {
    ok_ = false;
    return false;
  }
  at_ += gap;
  return true;
}

template <typename Number>
Number RosFields::number() {
  Number value{};
  if (!take(sizeof(Number), sizeof(Number))) return value;
  std::memcpy(&value, message_.data() + at_, sizeof(Number));
  at_ += sizeof(Number);
  return value;
}

std::uint8_t RosFields::u8() {
  return number<std::uint8_t>();
}

std::uint32_t RosFields::u32() {
  return number<std::uint32_t>();
}

double RosFields::f64() {
  return number<double>();
}

std::string_view RosFields::text() {
  const std::size_t length = u32();
  if (length > kMaxTextBytes) ok_ = false;
  if (!take(length, 1)) return {};
  const std::string_view found(reinterpret_cast<const char*>(message_.data()) + at_, length);
  at_ += length;
  return found.substr(0, found.find('\0'));  // CDR counts the closing zero
}

std::size_t RosFields::list(std::size_t element_bytes, std::size_t most) {
  const std::size_t length = u32();
  if (length > most) ok_ = false;
  if (!ok_ || (message_.size() - at_) / element_bytes < length) {
    ok_ = false;
    return 0;
  }
  return length;
}

std::size_t RosFields::long_list(std::uint64_t message_bytes) {
  const std::uint64_t length = u32();
  if (!ok_ || message_bytes < at_ || message_bytes - at_ < length) {
    ok_ = false;
    return 0;
  }
  return length;
}

std::int64_t RosFields::header_utime() {
  if (packing_ == RosPacking::kRos1) (void)u32();  // seq
  const std::int64_t seconds = u32(), nanoseconds = u32();
  (void)text();  // frame_id
  if (nanoseconds >= kNanoseconds) ok_ = false;
  return ok_ ? utime_of(seconds, nanoseconds) : 0;
}

std::optional<RosImage> read_ros_image(std::span<const std::uint8_t> head, std::uint64_t message_bytes,
                                       RosPacking packing) {
  RosFields fields(head, packing);
  RosImage image;
  image.utime = fields.header_utime();
  const std::uint32_t height = fields.u32(), width = fields.u32();
  image.encoding = fields.text();
  (void)fields.u8();  // is_bigendian, of 16 bit images only
  image.row_bytes = fields.u32();
  image.data_bytes = fields.long_list(message_bytes);
  image.data_offset = fields.position();
  if (!fields.ok() || width < 1 || height < 1 || width > ipc::kMaxImageSide_px ||
      height > ipc::kMaxImageSide_px || image.data_bytes > kMaxImageBytes ||
      image.row_bytes * std::uint64_t{height} > image.data_bytes)
    return {};
  image.width_px = static_cast<int>(width);
  image.height_px = static_cast<int>(height);
  return image;
}

std::optional<RosImage> read_ros_compressed_image(std::span<const std::uint8_t> head,
                                                  std::uint64_t message_bytes, RosPacking packing) {
  RosFields fields(head, packing);
  RosImage image;
  image.utime = fields.header_utime();
  image.encoding = fields.text();
  image.data_bytes = fields.long_list(message_bytes);
  image.data_offset = fields.position();
  if (!fields.ok() || image.data_bytes == 0 || image.data_bytes > kMaxImageBytes) return {};
  return image;
}

std::optional<RosImu> read_ros_imu(std::span<const std::uint8_t> message, RosPacking packing) {
  RosFields fields(message, packing);
  RosImu imu;
  imu.utime = fields.header_utime();
  (void)numbers<4 + 9>(&fields);  // orientation and its covariance
  const std::array<double, 3> rate = numbers<3>(&fields);
  (void)numbers<9>(&fields);
  const std::array<double, 3> acceleration = numbers<3>(&fields);
  if (!fields.ok() || !all_finite(rate) || !all_finite(acceleration)) return {};
  imu.angular_velocity_radps = {rate[0], rate[1], rate[2]};
  imu.acceleration_mps2 = {acceleration[0], acceleration[1], acceleration[2]};
  return imu;
}

std::optional<RosTwist> read_ros_odometry(std::span<const std::uint8_t> message, RosPacking packing) {
  RosFields fields(message, packing);
  const std::int64_t utime = fields.header_utime();
  (void)fields.text();             // child_frame_id
  (void)numbers<7 + 36>(&fields);  // pose and its covariance
  return twist_of(&fields, utime);
}

std::optional<RosTwist> read_ros_twist(std::span<const std::uint8_t> message, RosPacking packing) {
  RosFields fields(message, packing);
  const std::int64_t utime = fields.header_utime();
  return twist_of(&fields, utime);
}

std::optional<RosPose> read_ros_pose(std::span<const std::uint8_t> message, RosPacking packing,
                                     RosPoseLayout layout) {
  constexpr double kTolerance = 0.01;
  RosFields fields(message, packing);
  RosPose pose;
  pose.utime = fields.header_utime();
  if (layout == RosPoseLayout::kOfChild) (void)fields.text();  // child_frame_id
  const std::array<double, 3> position = numbers<3>(&fields);
  pose.T_world_body.t = {position[0], position[1], position[2]};
  if (layout != RosPoseLayout::kPoint) {
    const std::array<double, 4> q = numbers<4>(&fields);  // x y z w
    const Eigen::Quaterniond orientation(q[3], q[0], q[1], q[2]);
    if (!all_finite(q) || std::abs(orientation.norm() - 1.0) > kTolerance) return {};
    pose.T_world_body.q = orientation.normalized();
  }
  if (!fields.ok() || !all_finite(position)) return {};
  return pose;
}

std::optional<RosCameraInfo> read_ros_camera_info(std::span<const std::uint8_t> message, RosPacking packing) {
  RosFields fields(message, packing);
  (void)fields.header_utime();
  const std::uint32_t height = fields.u32(), width = fields.u32();
  const std::string model = quotable(fields.text());
  constexpr std::size_t kMostCoefficients = 64;  // those of a model that is not supported, too
  std::vector<double> d(fields.list(sizeof(double), kMostCoefficients));
  for (double& value : d) value = fields.f64();
  const std::array<double, 9> k = numbers<9>(&fields), r = numbers<9>(&fields);
  const std::array<double, 12> p = numbers<12>(&fields);
  const std::uint32_t binning_x = fields.u32(), binning_y = fields.u32();
  const std::uint32_t x_offset = fields.u32(), y_offset = fields.u32();
  if (!fields.ok() || !all_finite(d) || !all_finite(k)) return {};
  RosCameraInfo info;
  info.calibration =
      "width: " + std::to_string(width) + "\nheight: " + std::to_string(height) + "\ndistortion_model: \"" +
      model + "\"\nD: " + list_text(d) + "\nK: " + list_text(k) +
      "\nbinning_x: " + std::to_string(binning_x) + "\nbinning_y: " + std::to_string(binning_y) +
      "\nroi: {x_offset: " + std::to_string(x_offset) + ", y_offset: " + std::to_string(y_offset) + "}\n";
  info.rectification = rectification_of(r, p);
  return info;
}

}  // namespace farpoint::tools
