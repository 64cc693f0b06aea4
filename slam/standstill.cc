// SPDX-License-Identifier: Apache-2.0
#include "slam/standstill.h"

#include <algorithm>

namespace farpoint::slam {

void Standstill::note_motion(const Vector6d& velocity, double depth, std::int64_t utime, bool partly_frozen) {
  if (partly_frozen && !stands_ && moved_rad_per_s_ > kStoppable_rad_per_s) return;
  const double seen_rad_per_s = velocity.head<3>().norm() / std::max(depth, 1e-9) + velocity.tail<3>().norm();
  moved_rad_per_s_ = seen_rad_per_s;
  stands_ = seen_rad_per_s < kStanding_rad_per_s;
  seen_utime_ = utime;
}

bool Standstill::explains_repeat(std::int64_t utime) const {
  return stands_ && 1e-6 * static_cast<double>(utime - seen_utime_) <= kLongestRepeat_s;
}

}  // namespace farpoint::slam
