// SPDX-License-Identifier: Apache-2.0
// Trajectories and their text form: TUM format, one pose a line, `seconds tx ty tz qx qy qz qw`, '#' starts a
// comment.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "slam/geometry/se3.h"

namespace farpoint::tools {

// One pose at one time. time_s is a double as in the text form, so that pairing an estimate with truth gives
// the same result as in other programs that read the same files.
struct TimedPose {
  double time_s = 0.0;
  slam::SE3 pose;           // T_world_body (truth) or T_map_body (estimate)
  std::int32_t map_id = 0;  // poses of different maps share no frame
};

struct Trajectory {
  std::vector<TimedPose> poses;  // ascending in time
  bool has_orientation = true;   // false: position only (GPS); every rotation is the identity
};

// Reads a TUM file. A file whose every quaternion is 0 0 0 1 (or 0 0 0 0) holds positions only. Throws
// InputError naming file and line for a malformed line, for times that run backwards and where there is no
// pose.
[[nodiscard]] Trajectory read_tum(const std::filesystem::path& file);

// The TUM text: seconds with 6 decimals, metres and quaternions with 9.
[[nodiscard]] std::string to_tum(const Trajectory& trajectory);

// Microseconds to the double that `seconds with 6 decimals` reads back as.
[[nodiscard]] inline double seconds_of(std::int64_t utime) {
  return static_cast<double>(utime) / 1e6;
}

// From one time to another; any two, since the difference of damaged ones may not fit an integer.
[[nodiscard]] inline double seconds_between(std::int64_t from_utime, std::int64_t to_utime) {
  return (static_cast<double>(to_utime) - static_cast<double>(from_utime)) / 1e6;
}

// Moves every pose by T_body_point: T_world_body -> T_world_point.
void move_reference_point(const slam::SE3& T_body_point, Trajectory* trajectory);
// Expresses the trajectory in the axes of its own first pose (which becomes the identity). Precondition: not
// empty.
void start_at_origin(Trajectory* trajectory);

}  // namespace farpoint::tools
