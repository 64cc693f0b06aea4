// SPDX-License-Identifier: Apache-2.0
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
constexpr double kCoarseAge_s = 0.01;
constexpr unsigned kCoarseAgeStart = 12, kCoarseAgeBits = 4;

using Raw = std::array<std::uint64_t, kCanSignals>;

constexpr std::uint64_t ones(unsigned length) {
  return (std::uint64_t{1} << length) - 1;
}

// The most negative number says 'not available'. A value out of range is not available, never wrapped or
// clipped, since a clipped position would be a wrong one.
std::uint64_t signed_raw(unsigned length, double value, double step) {
  const double limit = static_cast<double>((std::int64_t{1} << (length - 1)) - 1);
  const double raw = std::round(value / step);
  const bool fits = raw >= -limit && raw <= limit;  // false for NaN
  const std::int64_t not_available = -(std::int64_t{1} << (length - 1));
  return static_cast<std::uint64_t>(fits ? static_cast<std::int64_t>(raw) : not_available) & ones(length);
}

// Not negative, rounded up: neither age nor uncertainty may look smaller than it is. All ones say 'not
// available', one less 'more than can be said'.
std::uint64_t magnitude_raw(unsigned length, double value, double step) {
  constexpr double kRounding = 1e-6;  // 0.0123 / 0.0001 is a little over 123
  const std::uint64_t not_available = ones(length);
  if (!(value >= 0) || std::isinf(value)) return not_available;
  const double most = static_cast<double>(not_available - 1);
  const double raw = std::max(std::ceil(value / step - kRounding), 0.0);
  return static_cast<std::uint64_t>(std::min(raw, most));
}

// Collects the raw value of every signal.
class RawValues {
 public:
  RawValues& code(CanSignal signal, std::uint64_t value) {
    at(signal) = value & ones(info_of(signal).length);
    return *this;
  }
  RawValues& value(CanSignal signal, bool available, double value) {
    const CanSignalInfo& info = info_of(signal);
    const double number = available ? value : kNan;
    at(signal) = info.kind == CanSignalKind::kSigned ? signed_raw(info.length, number, info.step)
                                                     : magnitude_raw(info.length, number, info.step);
    return *this;
  }
  // Three signals that follow each other in CanSignal.
  RawValues& vector(CanSignal first, bool available, const std::array<double, 3>& values) {
    for (std::size_t i = 0; i < values.size(); ++i)
      value(static_cast<CanSignal>(static_cast<std::size_t>(first) + i), available, values[i]);
    return *this;
  }
  [[nodiscard]] const Raw& all() const { return raw_; }

 private:
  std::uint64_t& at(CanSignal signal) { return raw_[static_cast<std::size_t>(signal)]; }
  Raw raw_{};
};

// An angle into [-180, 180] degrees.
double wrapped_deg(double angle_rad) {
  return std::remainder(angle_rad * kDegrees, 360.0);
}

void put_status(const OdometryEpoch& e, RawValues* out) {
  out->value(CanSignal::kAge, true, e.age_s)
      .code(CanSignal::kState, e.state)
      .code(CanSignal::kScaleState, e.scale_state)
      .code(CanSignal::kPoseValid, e.pose_valid)
      .code(CanSignal::kVelocityValid, e.velocity_valid)
      .code(CanSignal::kResetCounter, e.reset_counter)
      .code(CanSignal::kBootCounter, e.boot_counter)
      .code(CanSignal::kFromVision, e.from_vision)
      .code(CanSignal::kFrame, e.map_frame)
      .code(CanSignal::kPredicted, e.predicted)
      .code(CanSignal::kReason, static_cast<std::uint64_t>(e.reason));
}

void put_motion(const OdometryEpoch& e, RawValues* out) {
  const bool has_scale = e.scale_state == kScaleAssumed || e.scale_state == kScaleMetric;
  const bool position = e.pose_valid && has_scale, velocity = e.velocity_valid && has_scale;
  out->vector(CanSignal::kPositionX, position, e.position_m)
      .value(CanSignal::kYawRate, e.velocity_valid, e.yaw_rate_rad_s * kDegrees)
      .vector(CanSignal::kHeading, e.pose_valid,
              {wrapped_deg(e.heading_rad), wrapped_deg(e.roll_rad), wrapped_deg(e.pitch_rad)})
      .vector(CanSignal::kVelocityX, velocity, e.velocity_m_s)
      .vector(CanSignal::kSigmaPositionX, position, e.sigma_position_m)
      .vector(CanSignal::kSigmaHeading, e.pose_valid,
              {e.sigma_heading_rad * kDegrees, e.sigma_roll_rad * kDegrees, e.sigma_pitch_rad * kDegrees})
      .vector(CanSignal::kSigmaVelocityX, velocity, e.sigma_velocity_m_s)
      .value(CanSignal::kSigmaYawRate, e.velocity_valid, e.sigma_yaw_rate_rad_s * kDegrees);
}

void put_diagnosis(const OdometryEpoch& e, RawValues* out) {
  constexpr std::uint64_t kNoQuality = 0xff, kNoSensor = 0, kMsPeriod_us = 1000;
  const bool has_quality = e.quality >= 0 && e.quality <= 100;
  out->code(CanSignal::kQuality, has_quality ? static_cast<std::uint64_t>(e.quality) : kNoQuality)
      .code(CanSignal::kMapId, static_cast<std::uint64_t>(e.map_id))
      .code(CanSignal::kLevelled, static_cast<std::uint64_t>(e.levelled))
      .code(CanSignal::kBodyIsCamera, static_cast<std::uint64_t>(e.body_is_camera))
      .code(CanSignal::kScaleSource, static_cast<std::uint64_t>(e.scale_source))
      .value(CanSignal::kScaleSigma, true, e.scale_sigma)
      .code(CanSignal::kImu, kNoSensor)
      .code(CanSignal::kWheels, static_cast<std::uint64_t>(e.wheels))
      .code(CanSignal::kLayout, kCanLayoutNumber)
      .code(CanSignal::kSendTime, static_cast<std::uint64_t>(e.send_time_us) / kMsPeriod_us);
}

// Ors a value into the frame, Intel order.
void put_bits(CanFrame* frame, unsigned start, unsigned length, std::uint64_t value) {
  for (unsigned bit = 0; bit < length;) {
    const unsigned at = start + bit, room = 8 - at % 8;
    frame->data[at / 8] =
        static_cast<std::uint8_t>(frame->data[at / 8] | (value >> bit & ones(room)) << at % 8);
    bit += room;
  }
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
  RawValues values;
  put_status(epoch, &values);
  put_motion(epoch, &values);
  put_diagnosis(epoch, &values);
  const auto signals = can_signals();

  if (layout_.fd) {
    CanFrame frame;
    frame.id = layout_.base_id;
    frame.extended = layout_.extended;
    frame.size = kCanFdBytes;
    for (std::size_t i = 0; i < kCanSignals; ++i)
      put_bits(&frame, signals[i].fd_start(), signals[i].length, values.all()[i]);
    e2e5_protect(&frame, layout_.fd_data_id(), fd_counter_++);
    CanEpoch out;
    out.add(frame);
    return out;
  }

  std::array<CanFrame, kCanMessages> frames{};
  for (std::size_t i = 0; i < kCanSignals; ++i) {
    if (signals[i].message == CanMessage::kFdOnly) continue;
    put_bits(&frames[static_cast<std::size_t>(signals[i].message)], signals[i].start, signals[i].length,
             values.all()[i]);
  }
  CanEpoch out;
  for (std::size_t i = 0; i < kCanMessages; ++i) {
    const auto message = static_cast<CanMessage>(i);
    if (!layout_.is_due(message, epochs_)) continue;
    CanFrame& frame = frames[i];
    frame.id = layout_.id(message);
    frame.extended = layout_.extended;
    put_bits(&frame, kCoarseAgeStart, kCoarseAgeBits,
             magnitude_raw(kCoarseAgeBits, epoch.age_s, kCoarseAge_s));
    e2e_protect(&frame, layout_.data_id(message), counters_[i]);
    counters_[i] = e2e_next(counters_[i]);
    out.add(frame);
  }
  ++epochs_;
  return out;
}

}  // namespace farpoint::ipc
