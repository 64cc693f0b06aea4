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

  // Fastest motion, seen like that, that ends between two frames: brakes stop 1 m/s at 10 m within 0.1 s.
  static constexpr double kStoppable_rad_per_s = 0.15;

  // A frame with a pose. `velocity`: of the body, translation (map units a second), rotation (rad a second).
  // `depth`: median of the landmarks, map units. `partly_frozen`: a part of the image repeats the one
  // before. After a faster motion than brakes can stop, such an image does not show a vehicle that stands.
  void note_motion(const Vector6d& velocity, double depth, std::int64_t utime, bool partly_frozen);
  // A frame without a pose: whether the vehicle stands is unknown.
  void note_loss() { stands_ = false; }

  [[nodiscard]] bool stands() const { return stands_; }
  // Whether a frame at `utime` that repeats the one before shows a vehicle that stands.
  [[nodiscard]] bool explains_repeat(std::int64_t utime) const;

 private:
  bool stands_ = false;
  double moved_rad_per_s_ = 0;
  std::int64_t seen_utime_ = 0;  // of the newest frame with a pose and an image of its own
};

}  // namespace farpoint::slam
