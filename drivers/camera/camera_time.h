// From a driver's time stamp to an image's time: mid-exposure of its middle row, CLOCK_MONOTONIC.
//
// Documents do not say reliably which clock a stamp is of, so it is found out: an image that has just arrived
// was taken a moment ago, and only one clock says so.
#pragma once

#include <cstdint>

#include "drivers/camera/camera.h"

namespace farpoint::drivers {

// Readings of one moment, microseconds.
struct ClockReadings {
  std::int64_t monotonic_us = 0, boottime_us = 0, realtime_us = 0;
};
[[nodiscard]] ClockReadings read_clocks();

enum class SourceClock : std::uint8_t { kUnknown, kMonotonic, kBoottime, kRealtime };
[[nodiscard]] const char* to_string(SourceClock clock);

// The clock by which `stamp_us` is of the last moments before `now`. Where monotonic and boottime agree (the
// machine was never suspended) it is monotonic. kUnknown: none.
[[nodiscard]] SourceClock detect_clock(std::int64_t stamp_us, const ClockReadings& now);

// The stamp by CLOCK_MONOTONIC. Precondition: clock is known. `now` gives the clocks' distance, anew for each
// stamp, so that a system time that is set moves nothing but the stamps taken before and read after it.
[[nodiscard]] std::int64_t to_monotonic(std::int64_t stamp_us, SourceClock clock, const ClockReadings& now);

// What is added to a stamp for the middle of the exposure of the middle row. exposure_us below 0: unknown,
// taken as 0.
[[nodiscard]] std::int64_t mid_exposure_shift_us(StampPoint point, double exposure_us, double readout_s);

}  // namespace farpoint::drivers
