// SPDX-License-Identifier: Apache-2.0
// Images equal to the one before, bit for bit: a vehicle that stands behind an encoder shows them, and so
// does a stream that is frozen. They count as a standing vehicle where it stood before, and for a limited
// time.
#pragma once

#include <cstdint>

#include "slam/geometry/se3.h"

namespace farpoint::slam {

class Standstill {
 public:
  // Largest motion of a landmark at the median depth, seen from the vehicle, at which it stands.
  static constexpr double kStanding_rad_per_s = 0.01;
  // Longest run of equal images that stands for a vehicle at rest. A camera's noise ends one sooner.
  static constexpr double kLongestRepeat_s = 2.0;

  // A frame with a pose. `velocity`: of the body, translation (map units a second), rotation (rad a second).
  // `depth`: median of the landmarks, map units.
  void note_motion(const Vector6d& velocity, double depth, std::int64_t utime);
  // A frame without a pose: whether the vehicle stands is unknown.
  void note_loss() { stands_ = false; }

  [[nodiscard]] bool stands() const { return stands_; }
  // Whether a frame at `utime` that repeats the one before shows a vehicle that stands.
  [[nodiscard]] bool explains_repeat(std::int64_t utime) const;

 private:
  bool stands_ = false;
  std::int64_t seen_utime_ = 0;  // of the newest frame with a pose and an image of its own
};

}  // namespace farpoint::slam
