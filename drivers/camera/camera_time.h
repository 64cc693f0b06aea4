// SPDX-License-Identifier: Apache-2.0
// Converts a driver's time stamp to the image's time: mid-exposure of its middle row, CLOCK_MONOTONIC.
//
// Documents do not state reliably which clock a stamp is of. The clock is therefore detected: an image that
// has just arrived was taken a moment ago, which holds in one clock only.
#pragma once

#include <cstdint>

#include "drivers/camera/camera.h"

namespace farpoint::drivers {

// All clocks at one moment, microseconds.
struct ClockReadings {
  std::int64_t monotonic_us = 0, boottime_us = 0, realtime_us = 0;
};
[[nodiscard]] ClockReadings read_clocks();

enum class SourceClock : std::uint8_t { kUnknown, kMonotonic, kBoottime, kRealtime };
[[nodiscard]] const char* to_string(SourceClock clock);

// Returns the clock in which `stamp_us` lies just before `now`. Monotonic wins where monotonic and boottime
// agree (no suspend since boot). kUnknown: no clock fits.
[[nodiscard]] SourceClock detect_clock(std::int64_t stamp_us, const ClockReadings& now);

// Converts the stamp to CLOCK_MONOTONIC. Precondition: the clock is not kUnknown. `now` is read for each
// stamp: setting the system clock affects only stamps taken before and read after it.
[[nodiscard]] std::int64_t to_monotonic(std::int64_t stamp_us, SourceClock clock, const ClockReadings& now);

// Returns the offset from a stamp to the middle of the exposure of the middle row. A negative exposure_us
// (unknown) counts as 0.
[[nodiscard]] std::int64_t mid_exposure_shift_us(StampPoint point, double exposure_us, double readout_s);

}  // namespace farpoint::drivers
