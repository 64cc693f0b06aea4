// SPDX-License-Identifier: Apache-2.0
// The MAVLink messages that Farpoint sends and takes: HEARTBEAT (0), TIMESYNC (111), ODOMETRY (331), of the
// dialect 'common'. Units are the messages' own: metres, radians, seconds.
#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "ipc/mavlink/frame.h"

namespace farpoint::ipc::mavlink {

// Values of the enumerations of the dialect that are sent.
inline constexpr std::uint8_t kFrameBodyFrd = 12, kFrameLocalFrd = 20;              // MAV_FRAME
inline constexpr std::uint8_t kEstimatorVision = 2;                                 // MAV_ESTIMATOR_TYPE
inline constexpr std::uint8_t kTypeOnboardController = 18, kAutopilotInvalid = 8;   // MAV_TYPE, MAV_AUTOPILOT
inline constexpr std::uint8_t kStateBoot = 1, kStateStandby = 3, kStateActive = 4;  // MAV_STATE
inline constexpr std::uint8_t kComponentAutopilot = 1;                              // MAV_COMP_ID_AUTOPILOT1

// Upper right triangle of a symmetric 6x6 matrix, row by row. A first element of NaN: unknown.
using Triangle = std::array<float, 21>;
inline constexpr Triangle kUnknownTriangle{std::numeric_limits<float>::quiet_NaN()};

struct Odometry {
  std::uint64_t time_us = 0;
  std::array<float, 3> position_m{};                // of the body in the local frame
  std::array<float, 4> orientation_wxyz{};          // from the body to the local frame
  std::array<float, 3> velocity_m_s{};              // along the body's axes
  std::array<float, 3> rates_rad_s{};               // about them
  Triangle pose_covariance = kUnknownTriangle;      // x y z of the local frame, roll, pitch, yaw
  Triangle velocity_covariance = kUnknownTriangle;  // velocity, then rates, of the body's axes
  std::uint8_t frame = kFrameLocalFrd, child_frame = kFrameBodyFrd;
  std::uint8_t reset_counter = 0;
  std::uint8_t estimator = kEstimatorVision;
  std::int8_t quality = 0;  // -1 failed, 0 unknown, 1 worst .. 100 best
};
[[nodiscard]] Frame encode(const Odometry& odometry, const Sender& sender, std::uint8_t sequence);

// A component that is no autopilot.
struct Heartbeat {
  std::uint8_t state = kStateActive;  // MAV_STATE
};
[[nodiscard]] Frame encode(const Heartbeat& heartbeat, const Sender& sender, std::uint8_t sequence);

// A request has tc1 0 and the asking side's time in ts1; the answer repeats ts1 and holds the answering
// side's time in tc1.
struct Timesync {
  std::int64_t tc1_ns = 0, ts1_ns = 0;
  std::uint8_t target_system = 0, target_component = 0;  // 0: any
};
[[nodiscard]] Frame encode(const Timesync& timesync, const Sender& sender, std::uint8_t sequence);
// Precondition: received.id is kTimesync's.
[[nodiscard]] Timesync decode_timesync(const Received& received);

}  // namespace farpoint::ipc::mavlink
