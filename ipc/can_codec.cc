#include "ipc/can_codec.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

namespace farpoint::ipc {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
// As status_t.lcm says; the codec needs nothing else of LCM.
constexpr std::uint8_t kScaleAssumed = 1, kScaleMetric = 2;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// What one unit of a raw value means, as in the DBC.
constexpr double kPosition_m = 0.01;
constexpr double kAngle_deg = 0.01;
constexpr double kVelocity_m_s = 0.005;
constexpr double kYawRate_deg_s = 0.05;
constexpr double kSigmaPosition_m = 0.001;
constexpr double kSigmaAngle_deg = 0.001;
constexpr double kSigmaVelocity_m_s = 0.01;
constexpr double kSigmaYawRate_deg_s = 0.01;
constexpr double kAge_s = 0.0001;
constexpr double kCoarseAge_s = 0.01;

// Fills one frame's bits from bit 12 on (Intel order: bit n of the frame is bit n of a little-endian number);
// CRC and counter come last.
class Packer {
 public:
  Packer& bits(unsigned start, unsigned length, std::uint64_t value) {
    payload_ |= (value & ((std::uint64_t{1} << length) - 1)) << start;
    return *this;
  }
  // Signed; the most negative number says 'not available'. Out of range is not available, never wrapped or
  // clipped: a clipped position would be a wrong one.
  Packer& signed_value(unsigned start, unsigned length, double value, double unit) {
    const double limit = static_cast<double>((std::int64_t{1} << (length - 1)) - 1);
    const double raw = std::round(value / unit);
    const bool fits = raw >= -limit && raw <= limit;  // false for NaN
    const std::int64_t not_available = -(std::int64_t{1} << (length - 1));
    return bits(start, length,
                static_cast<std::uint64_t>(fits ? static_cast<std::int64_t>(raw) : not_available));
  }
  // Not negative, rounded up: neither age nor uncertainty may look smaller than it is. All ones say 'not
  // available', one less 'more than can be said'.
  Packer& magnitude(unsigned start, unsigned length, double value, double unit) {
    constexpr double kRounding = 1e-6;  // 0.0123 / 0.0001 is a little over 123
    const std::uint64_t not_available = (std::uint64_t{1} << length) - 1;
    if (!(value >= 0) || std::isinf(value)) return bits(start, length, not_available);
    const double most = static_cast<double>(not_available - 1);
    const double raw = std::max(std::ceil(value / unit - kRounding), 0.0);
    return bits(start, length, static_cast<std::uint64_t>(std::min(raw, most)));
  }

  [[nodiscard]] CanFrame frame(CanMessage message, std::uint8_t counter) const {
    CanFrame out;
    out.id = can_id(message);
    for (std::size_t i = 0; i < out.size; ++i) out.data[i] = static_cast<std::uint8_t>(payload_ >> (8 * i));
    e2e_protect(&out, can_data_id(message), counter);
    return out;
  }

 private:
  std::uint64_t payload_ = 0;
};

// An angle into [-180, 180] degrees.
double wrapped_deg(double angle_rad) {
  return std::remainder(angle_rad * kDegrees, 360.0);
}

double value_if(bool available, double value) {
  return available ? value : kNan;
}

struct Available {
  bool position, angles, velocity, yaw_rate;
};

Available available(const OdometryEpoch& epoch) {
  const bool has_scale = epoch.scale_state == kScaleAssumed || epoch.scale_state == kScaleMetric;
  return {epoch.pose_valid && has_scale, epoch.pose_valid, epoch.velocity_valid && has_scale,
          epoch.velocity_valid};
}

Packer status(const OdometryEpoch& epoch) {
  constexpr std::uint64_t kNoQuality = 0xff;
  const bool has_quality = epoch.quality >= 0 && epoch.quality <= 100;
  Packer out;
  out.magnitude(16, 16, epoch.age_s, kAge_s);
  out.bits(32, 4, epoch.state).bits(36, 2, epoch.scale_state);
  out.bits(38, 1, epoch.pose_valid).bits(39, 1, epoch.velocity_valid);
  out.bits(40, 8, epoch.reset_counter);
  out.bits(48, 8, has_quality ? static_cast<std::uint64_t>(epoch.quality) : kNoQuality);
  out.bits(56, 1, epoch.from_vision).bits(57, 1, epoch.map_frame);
  out.bits(58, 6, static_cast<std::uint64_t>(epoch.map_id));
  return out;
}

// Three numbers of 16 bits behind the head: signed values ...
Packer three_values(const std::array<double, 3>& values, double unit) {
  Packer out;
  for (unsigned i = 0; i < 3; ++i) out.signed_value(16 + 16 * i, 16, values[i], unit);
  return out;
}

// ... and standard deviations.
Packer three_sigmas(bool available, const std::array<double, 3>& values, double unit) {
  Packer out;
  for (unsigned i = 0; i < 3; ++i) out.magnitude(16 + 16 * i, 16, value_if(available, values[i]), unit);
  return out;
}

Packer velocity_sigma(const OdometryEpoch& epoch, const Available& has) {
  Packer out;
  for (unsigned i = 0; i < 3; ++i) {
    out.magnitude(16 + 12 * i, 12, value_if(has.velocity, epoch.sigma_velocity_m_s[i]), kSigmaVelocity_m_s);
  }
  out.magnitude(52, 12, value_if(has.yaw_rate, epoch.sigma_yaw_rate_rad_s * kDegrees), kSigmaYawRate_deg_s);
  return out;
}

Packer content(CanMessage message, const OdometryEpoch& epoch, const Available& has) {
  const auto& position = epoch.position_m;
  Packer out;
  switch (message) {
    case CanMessage::kStatus:
      return status(epoch);
    case CanMessage::kPositionXy:
      out.signed_value(16, 24, value_if(has.position, position[0]), kPosition_m);
      out.signed_value(40, 24, value_if(has.position, position[1]), kPosition_m);
      return out;
    case CanMessage::kPositionZYawRate:
      out.signed_value(16, 24, value_if(has.position, position[2]), kPosition_m);
      out.signed_value(40, 16, value_if(has.yaw_rate, epoch.yaw_rate_rad_s * kDegrees), kYawRate_deg_s);
      return out;
    case CanMessage::kAttitude:
      return three_values({value_if(has.angles, wrapped_deg(epoch.heading_rad)),
                           value_if(has.angles, wrapped_deg(epoch.roll_rad)),
                           value_if(has.angles, wrapped_deg(epoch.pitch_rad))},
                          kAngle_deg);
    case CanMessage::kVelocity:
      return three_values(
          {value_if(has.velocity, epoch.velocity_m_s[0]), value_if(has.velocity, epoch.velocity_m_s[1]),
           value_if(has.velocity, epoch.velocity_m_s[2])},
          kVelocity_m_s);
    case CanMessage::kPositionSigma:
      return three_sigmas(has.position, epoch.sigma_position_m, kSigmaPosition_m);
    case CanMessage::kAttitudeSigma:
      return three_sigmas(has.angles,
                          {epoch.sigma_heading_rad * kDegrees, epoch.sigma_roll_rad * kDegrees,
                           epoch.sigma_pitch_rad * kDegrees},
                          kSigmaAngle_deg);
    case CanMessage::kVelocitySigma:
      return velocity_sigma(epoch, has);
  }
  return out;
}

}  // namespace

EulerAngles euler_angles(const std::array<double, 4>& orientation_wxyz) {
  const auto& [w, x, y, z] = orientation_wxyz;
  EulerAngles out;
  out.heading_rad = std::atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
  out.pitch_rad = std::asin(std::clamp(2 * (w * y - x * z), -1.0, 1.0));
  out.roll_rad = std::atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y));
  return out;
}

CanEpoch CanEncoder::encode(const OdometryEpoch& epoch) noexcept {
  const Available has = available(epoch);
  CanEpoch frames;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto message = static_cast<CanMessage>(i);
    Packer packer = content(message, epoch, has);
    packer.magnitude(12, 4, epoch.age_s, kCoarseAge_s);  // every frame tells its age
    frames[i] = packer.frame(message, counter_);
  }
  counter_ = e2e_next(counter_);
  return frames;
}

}  // namespace farpoint::ipc
