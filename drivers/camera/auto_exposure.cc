// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/auto_exposure.h"

#include <algorithm>
#include <cmath>

namespace farpoint::drivers {
namespace {

constexpr double kGainStops = 4.0;     // taken for a camera's whole gain
constexpr double kDeadBand = 0.2;      // stops: less is left alone
constexpr double kLargestStep = 1.0;   // stops
constexpr double kDarkest_grey = 2.0;  // below it nothing can be measured but "dark"
constexpr double kSaturated_grey = 250.0;

}  // namespace

AutoExposure::AutoExposure(const ExposureOptions& options, const ExposureRange& range)
    : options_(options), range_(range) {
  const double longest_us = std::clamp(options.max_us, range.min_us, range.max_us);
  const double short_us = std::clamp(options.short_us, range.min_us, longest_us);
  log_min_ = std::log2(std::max(range.min_us, 1.0));
  log_short_ = std::max(std::log2(std::max(short_us, 1.0)), log_min_);
  log_max_ = std::max(std::log2(std::max(longest_us, 1.0)), log_short_);
  gain_stops_ = range.gain_max > range.gain_min ? kGainStops * options.max_gain_share : 0.0;
  demand_stops_ = log_short_ - log_min_;
}

ExposureSetting AutoExposure::setting() const {
  const double short_stops = log_short_ - log_min_;
  const double beyond_short = std::clamp(demand_stops_ - short_stops, 0.0, gain_stops_);
  const double beyond_gain = std::max(0.0, demand_stops_ - short_stops - gain_stops_);
  ExposureSetting s;
  s.exposure_us = std::exp2(log_min_ + std::min(demand_stops_, short_stops) + beyond_gain);
  const double steps = beyond_short / kGainStops * static_cast<double>(range_.gain_max - range_.gain_min);
  s.gain = range_.gain_min + static_cast<int>(std::lround(steps));
  return s;
}

ExposureSetting AutoExposure::update(double mean_grey) {
  if (++frames_since_change_ < kSettleFrames) return setting();
  // Cameras apply a gamma: the step in stops is damped rather than modelled.
  constexpr double kDamping = 0.7;
  double step = kDamping * std::log2(options_.target_grey / std::max(mean_grey, kDarkest_grey));
  if (mean_grey > kSaturated_grey) step = -kLargestStep;
  if (std::abs(step) < kDeadBand) return setting();
  const double most = log_max_ - log_min_ + gain_stops_;
  const double wanted = std::clamp(demand_stops_ + std::clamp(step, -kLargestStep, kLargestStep), 0.0, most);
  if (wanted != demand_stops_) frames_since_change_ = 0;
  demand_stops_ = wanted;
  return setting();
}

}  // namespace farpoint::drivers
