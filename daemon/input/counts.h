// SPDX-License-Identifier: Apache-2.0
// Counts since the start: received, refused, not sent.
#pragma once

#include <cstdint>

namespace farpoint::daemon {

struct InputCounts {
  std::int64_t images = 0;  // of all cameras
  std::int64_t wrong_size = 0, undecodable = 0, unknown_camera = 0, times_backwards = 0;
  std::int64_t messages_undecodable = 0, log_damages = 0;
  std::int64_t imu_invalid = 0, wheels_invalid = 0;  // not finite, or beyond any sensor's range
  std::int64_t times_unknown = 0;  // live: stamps of no clock; the time of arrival stands in
  // Live cameras: gaps in the driver's numbers, buffers marked as damaged, losses and stalls.
  std::int64_t missing = 0, flagged = 0, camera_losses = 0;
  std::int64_t not_recorded = 0;  // live with --record: images left out by the recorder
  // Live with a second camera: pairs by time, and images without a partner.
  std::int64_t stereo_pairs = 0, stereo_left_alone = 0, stereo_right_alone = 0;
  std::int64_t stereo_skew_us = 0;  // of the last pair: second camera's time minus the first's
};

// Messages and frames not sent. The bus is counted here because its sink is no message sink.
struct OutputCounts {
  std::int64_t can_send_errors = 0, can_bus_offs = 0, can_received = 0;
  std::int64_t can_not_logged = 0;  // frames missing in the log
  // Live: bits of the functions that have not begun (SideFunction), and attempts that failed.
  std::int32_t side_missing = 0;
  std::int64_t side_failures = 0;
  std::int8_t can_state = 0;  // drivers::CanState
  // Of MAVLink, as status_t has them.
  std::int64_t mavlink_sent = 0, mavlink_without_scale = 0, mavlink_without_pose = 0;
  std::int64_t mavlink_send_errors = 0, mavlink_received = 0, mavlink_round_trip_us = -1;
};

}  // namespace farpoint::daemon
