// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/camera_time.h"

#include <algorithm>
#include <cmath>
#include <ctime>

namespace farpoint::drivers {
namespace {

// An image may have waited in the driver; a stamp may lie a little ahead where a device's clock is
// translated.
constexpr std::int64_t kOldest_us = 2'000'000, kAhead_us = 20'000;

std::int64_t read_us(clockid_t id) {
  timespec t{};
  clock_gettime(id, &t);
  return std::int64_t{t.tv_sec} * 1'000'000 + t.tv_nsec / 1000;
}

bool is_recent(std::int64_t stamp_us, std::int64_t now_us) {
  return stamp_us <= now_us + kAhead_us && stamp_us >= now_us - kOldest_us;
}

}  // namespace

ClockReadings read_clocks() {
  return {read_us(CLOCK_MONOTONIC), read_us(CLOCK_BOOTTIME), read_us(CLOCK_REALTIME)};
}

const char* to_string(SourceClock clock) {
  switch (clock) {
    case SourceClock::kUnknown:
      return "unknown";
    case SourceClock::kMonotonic:
      return "CLOCK_MONOTONIC";
    case SourceClock::kBoottime:
      return "CLOCK_BOOTTIME";
    case SourceClock::kRealtime:
      return "CLOCK_REALTIME";
  }
  return "?";
}

SourceClock detect_clock(std::int64_t stamp_us, const ClockReadings& now) {
  if (is_recent(stamp_us, now.monotonic_us)) return SourceClock::kMonotonic;
  if (is_recent(stamp_us, now.boottime_us)) return SourceClock::kBoottime;
  if (is_recent(stamp_us, now.realtime_us)) return SourceClock::kRealtime;
  return SourceClock::kUnknown;
}

std::int64_t to_monotonic(std::int64_t stamp_us, SourceClock clock, const ClockReadings& now) {
  if (clock == SourceClock::kBoottime) return stamp_us - now.boottime_us + now.monotonic_us;
  if (clock == SourceClock::kRealtime) return stamp_us - now.realtime_us + now.monotonic_us;
  return stamp_us;
}

std::int64_t mid_exposure_shift_us(StampPoint point, double exposure_us, double readout_s) {
  const double half_exposure_us = 0.5 * std::max(exposure_us, 0.0);
  const double half_readout_us = 0.5e6 * readout_s;
  switch (point) {
    case StampPoint::kAuto:  // resolved before
    case StampPoint::kStartOfExposure:
      return std::llround(half_exposure_us + half_readout_us);
    case StampPoint::kStartOfReadout:
      return std::llround(half_readout_us - half_exposure_us);
    case StampPoint::kEndOfFrame:
      return std::llround(-half_readout_us - half_exposure_us);
  }
  return 0;
}

}  // namespace farpoint::drivers
