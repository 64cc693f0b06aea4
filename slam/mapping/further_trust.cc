// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/further_trust.h"

#include <algorithm>
#include <cmath>

namespace farpoint::slam {

namespace {

// A field that stiff rigs and right calibrations leave. Below the first camera's limit (soundness.cc): the
// further camera gives way before it bends the map.
constexpr double kSoundField_px = 0.1;
// Time after which a field is forgotten.
constexpr double kMemory_s = 2.0;

}  // namespace

void FurtherTrust::note_adjustment(const Soundness& soundness, std::int64_t utime) {
  const double time_s = std::clamp(1e-6 * static_cast<double>(utime - utime_), 0.0, kMemory_s);
  utime_ = utime;
  const double field_px = soundness.further_field_px;
  const double beyond_px2 = std::max(0.0, field_px * field_px - kSoundField_px * kSoundField_px);
  shared_px2_ = std::max(beyond_px2, shared_px2_ * std::exp(-time_s / kMemory_s));
  const double sigma_px = soundness.further_sigma_px / sigma_factor_;
  if (sigma_px > 0.0)
    sigma_factor_ = std::sqrt(1.0 + soundness.further_measurements * shared_px2_ / (sigma_px * sigma_px));
}

}  // namespace farpoint::slam
