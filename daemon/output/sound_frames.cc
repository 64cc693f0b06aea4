// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/sound_frames.h"

#include <algorithm>
#include <cstddef>
#include <optional>

namespace farpoint::daemon {

namespace {

bool within_reach(std::int64_t from_utime, std::int64_t to_utime) {
  return 1e-6 * static_cast<double>(to_utime - from_utime) <= kSoundReach_s;
}

}  // namespace

std::vector<std::uint8_t> sound_frames(const slam::MapTrajectory& trajectory,
                                       std::span<const std::int64_t> live_utimes) {
  const std::size_t count = trajectory.frames.size();
  std::vector<std::uint8_t> sound(count, 0);
  std::optional<std::int64_t> valid;  // the last one before
  for (std::size_t i = 0; i < count; ++i) {
    const std::int64_t utime = trajectory.frames[i].utime;
    if (std::binary_search(live_utimes.begin(), live_utimes.end(), utime)) {
      if (!valid) {
        const std::size_t first = i - std::min(i, kWaitingFrames);
        std::fill(sound.begin() + static_cast<std::ptrdiff_t>(first),
                  sound.begin() + static_cast<std::ptrdiff_t>(i), std::uint8_t{1});
      }
      valid = utime;
    }
    if (valid && within_reach(*valid, utime)) sound[i] = 1;
  }
  valid.reset();
  for (std::size_t i = count; i-- > 0;) {
    const std::int64_t utime = trajectory.frames[i].utime;
    if (std::binary_search(live_utimes.begin(), live_utimes.end(), utime)) valid = utime;
    if (valid && within_reach(utime, *valid)) sound[i] = 1;
  }
  return sound;
}

}  // namespace farpoint::daemon
