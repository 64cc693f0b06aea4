// Odometry as CAN frames. config/farpoint.dbc describes the same to the receiver; tests hold both together.
#pragma once

#include <array>
#include <cstdint>

#include "ipc/can_frame.h"
#include "ipc/e2e.h"

namespace farpoint::ipc {

// What one camera frame gave. Metres, radians, seconds. A value that is not finite is sent as 'not
// available'.
struct OdometryEpoch {
  std::uint8_t state = 0;        // status_t::STATE_*
  std::uint8_t scale_state = 0;  // status_t::SCALE_*; unknown: no position, no velocity
  bool pose_valid = false;       // else no position, no angles
  bool velocity_valid = false;   // else no velocity, no yaw rate
  bool from_vision = false;
  bool map_frame = false;           // the pose is of the map frame (may jump), else of odom (never jumps)
  std::uint32_t reset_counter = 0;  // sent modulo 256
  std::int32_t map_id = 0;          // sent modulo 64
  int quality = -1;                 // 0..100, anything else: not available
  double age_s = 0;                 // from mid-exposure to sending

  std::array<double, 3> position_m{};  // x y z
  double heading_rad = 0, roll_rad = 0, pitch_rad = 0;
  std::array<double, 3> velocity_m_s{};  // body axes
  double yaw_rate_rad_s = 0;             // about the body's z axis
  // Standard deviations; negative or not finite: not available.
  std::array<double, 3> sigma_position_m{};
  double sigma_heading_rad = 0, sigma_roll_rad = 0, sigma_pitch_rad = 0;
  std::array<double, 3> sigma_velocity_m_s{};
  double sigma_yaw_rate_rad_s = 0;
};

// Heading (yaw, left positive), pitch (nose down positive) and roll of a body with REP-103 axes: R =
// Rz(heading) Ry(pitch) Rx(roll). Precondition: unit quaternion w x y z.
struct EulerAngles {
  double heading_rad = 0, roll_rad = 0, pitch_rad = 0;
};
[[nodiscard]] EulerAngles euler_angles(const std::array<double, 4>& orientation_wxyz);

// The frames of one epoch, in the order of sending; identifiers and Data IDs.
enum class CanMessage : std::uint8_t {
  kStatus = 0,
  kPositionXy,
  kPositionZYawRate,
  kAttitude,
  kVelocity,
  kPositionSigma,
  kAttitudeSigma,
  kVelocitySigma,
};
inline constexpr std::size_t kCanFramesPerEpoch = 8;
inline constexpr std::uint32_t kCanBaseId = 0x300;       // identifier = base + message
inline constexpr std::uint16_t kCanBaseDataId = 0x4650;  // E2E Data ID = base + message

[[nodiscard]] constexpr std::uint32_t can_id(CanMessage message) {
  return kCanBaseId + static_cast<std::uint32_t>(message);
}
[[nodiscard]] constexpr std::uint16_t can_data_id(CanMessage message) {
  return static_cast<std::uint16_t>(kCanBaseDataId + static_cast<std::uint16_t>(message));
}

using CanEpoch = std::array<CanFrame, kCanFramesPerEpoch>;

// Numbers epochs: all frames of one carry the same counter. No allocation, never throws.
class CanEncoder {
 public:
  [[nodiscard]] CanEpoch encode(const OdometryEpoch& epoch) noexcept;

 private:
  std::uint8_t counter_ = 0;
};

}  // namespace farpoint::ipc
