// SPDX-License-Identifier: Apache-2.0
// What mapping has found out about the present map, as of its last adjustment: whether its unit is steady,
// and whether what is left in the residuals is what the measurements' errors leave.
#pragma once

#include <algorithm>
#include <cstdint>

#include "slam/map/refusal.h"

namespace farpoint::slam {

// What the images say of the wheels.
enum class WheelTrust : std::uint8_t {
  kNone,          // not judged: no samples, no motion, or no metres to measure by
  kTrusted,       // wheels and images agree
  kContradicted,  // another factor than the configuration allows, or another turn
};

// What a map's metre comes from.
enum class MetreSource : std::uint8_t { kNone, kCameras, kWheels };

struct MapJudgement {
  // After an unsound adjustment: time over which the map must be sound, until its poses are used again.
  static constexpr double kSoundTime_s = 1.5;
  // Largest change of a steady unit by one adjustment.
  static constexpr double kSteadyChange = 0.02;

  bool steady = false;                    // the unit has held once
  bool metric = false;                    // map units are metres
  bool sound = true;                      // the last adjustment
  bool calibration_contradicted = false;  // the images ask for a calibration far from the given one
  double sound_s = kSoundTime_s;          // time of sound adjustments up to adjusted_utime
  std::int64_t adjusted_utime = 0;        // of the newest keyframe of the last adjustment
  double scale_change = 1.0;              // factor of the unit by the last adjustment
  double further_sigma_factor = 1.0;      // of the further cameras' measurements (mapping/further_trust.h)
  Refusal unsound{};                      // what the last adjustment left too much of
  WheelTrust wheels = WheelTrust::kNone;
  double wheel_factor = 1.0;  // metres driven in one that the wheels tell
  double unit_sigma = 0.0;    // of the metre, relative, where wheels gave it; 0 without them

  [[nodiscard]] MetreSource metre() const {
    if (!metric) return MetreSource::kNone;
    return unit_sigma > 0.0 ? MetreSource::kWheels : MetreSource::kCameras;
  }

  // How long the map has been sound, as of a frame at `utime`. The time since the last adjustment counts: a
  // vehicle that stands makes no keyframes.
  [[nodiscard]] double sound_time_s(std::int64_t utime) const {
    return sound ? sound_s + 1e-6 * static_cast<double>(std::max<std::int64_t>(utime - adjusted_utime, 0))
                 : 0.0;
  }
  // Whether poses against this map can be used.
  [[nodiscard]] bool settled(std::int64_t utime) const {
    return steady && sound && sound_time_s(utime) >= kSoundTime_s;
  }
};

}  // namespace farpoint::slam
