// SPDX-License-Identifier: Apache-2.0
// Odometry as CAN frames of layout 2 (ipc/can_layout.h). config/farpoint.dbc describes the same to the
// receiver; tests hold both together.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "ipc/can_frame.h"
#include "ipc/can_layout.h"
#include "ipc/e2e.h"
#include "ipc/reason.h"

namespace farpoint::ipc {

// Raw value of signal State, beyond those of status_t.
inline constexpr std::uint8_t kCanStateLost = 5, kCanStateStopped = 8;

// Raw values of Levelled and BodyIsCamera.
enum class CanYesNo : std::uint8_t { kNo = 0, kYes = 1, kNotAvailable = 3 };

// Raw values of ScaleSource that this version sends.
enum class CanScaleSource : std::uint8_t {
  kNone = 0,
  kAssumed = 1,
  kSecondCamera = 2,
  kWheels = 4,
  kNotAvailable = 15
};
enum class CanSensorUse : std::uint8_t { kNone = 0, kStarting = 1, kUsed = 2, kContradicted = 3 };

// What is sent at one time. Metres, radians, seconds. A value that is not finite is sent as 'not available'.
struct OdometryEpoch {
  std::uint8_t state = 0;        // status_t::STATE_*, or kCanStateStopped
  std::uint8_t scale_state = 0;  // status_t::SCALE_*; unknown: no position, no velocity
  bool pose_valid = false;       // else no position, no angles
  bool velocity_valid = false;   // else no velocity, no yaw rate
  bool from_vision = false;
  bool predicted = false;
  bool map_frame = false;           // the pose is of the map frame (may jump), else of odom (never jumps)
  std::uint32_t reset_counter = 0;  // sent modulo 256
  std::uint8_t boot_counter = 0;
  Reason reason = Reason::kNone;
  std::int32_t map_id = 0;  // sent modulo 256
  int quality = -1;         // 0..100, anything else: not available
  double age_s = 0;         // from mid-exposure to sending
  std::int64_t send_time_us = 0;

  std::array<double, 3> position_m{};  // x y z
  double heading_rad = 0, roll_rad = 0, pitch_rad = 0;
  std::array<double, 3> velocity_m_s{};  // body axes
  double yaw_rate_rad_s = 0;             // about the body's z axis
  // Standard deviations; negative or not finite: not available.
  std::array<double, 3> sigma_position_m{-1.0, -1.0, -1.0};
  double sigma_heading_rad = -1.0, sigma_roll_rad = -1.0, sigma_pitch_rad = -1.0;
  std::array<double, 3> sigma_velocity_m_s{-1.0, -1.0, -1.0};
  double sigma_yaw_rate_rad_s = -1.0;

  CanYesNo levelled = CanYesNo::kNotAvailable, body_is_camera = CanYesNo::kNotAvailable;
  CanScaleSource scale_source = CanScaleSource::kNotAvailable;
  double scale_sigma = -1.0;  // relative
  CanSensorUse wheels = CanSensorUse::kNone;
};

// Heading (yaw, left positive), pitch (nose down positive) and roll of a body with REP-103 axes: R =
// Rz(heading) Ry(pitch) Rx(roll). Precondition: unit quaternion w x y z.
struct EulerAngles {
  double heading_rad = 0, roll_rad = 0, pitch_rad = 0;
};
[[nodiscard]] EulerAngles euler_angles(const std::array<double, 4>& orientation_wxyz);

// The frames of one epoch, in the order of sending. The first is the status frame, or CAN FD's only frame.
class CanEpoch {
 public:
  [[nodiscard]] std::span<const CanFrame> frames() const { return {frames_.data(), size_}; }
  [[nodiscard]] std::size_t size() const { return size_; }
  void add(const CanFrame& frame) { frames_.at(size_++) = frame; }

 private:
  std::array<CanFrame, kCanMessages> frames_{};
  std::size_t size_ = 0;
};

// Encodes and counts. The counter of a message goes on by one each time it is encoded, so that messages which
// go out with every epoch carry the same. No allocation, never throws.
class CanEncoder {
 public:
  explicit CanEncoder(const CanLayout& layout = {}) : layout_(layout) {}
  [[nodiscard]] CanEpoch encode(const OdometryEpoch& epoch) noexcept;
  [[nodiscard]] const CanLayout& layout() const { return layout_; }

 private:
  CanLayout layout_;
  std::uint64_t epochs_ = 0;
  std::array<std::uint8_t, kCanMessages> counters_{};
  std::uint8_t fd_counter_ = 0;
};

}  // namespace farpoint::ipc
