// SPDX-License-Identifier: Apache-2.0
// Messages at a rate, by the frames' time.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

namespace farpoint::daemon {

// The first message is due with the first frame.
inline constexpr std::int64_t kAtOnce = std::numeric_limits<std::int64_t>::min();

// True where a message of this rate is due. The next one is due a period after this frame, so that a gap in
// the recording is not followed by a burst.
[[nodiscard]] inline bool due(std::int64_t utime, double rate_hz, std::int64_t* next_utime) {
  if (rate_hz <= 0.0 || utime < *next_utime) return false;
  // Frames do not come at multiples of the period: half a millisecond early is on time.
  constexpr std::int64_t kTolerance_us = 500;
  *next_utime = utime + std::llround(1e6 / rate_hz) - kTolerance_us;
  return true;
}

}  // namespace farpoint::daemon
