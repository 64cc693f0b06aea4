// SPDX-License-Identifier: Apache-2.0
// Chooses exposure and gain by the brightness of the images. Prefers short exposures: noise costs a tracker
// less than motion blur.
#pragma once

#include "drivers/camera/camera.h"

namespace farpoint::drivers {

// Limits of a camera.
struct ExposureRange {
  double min_us = 100, max_us = 33000;
  int gain_min = 0, gain_max = 0;  // the camera's own steps; equal: it has no gain
};

struct ExposureSetting {
  double exposure_us = 0;
  int gain = 0;
  [[nodiscard]] bool operator==(const ExposureSetting&) const = default;
};

// One number, the demand, runs through three ranges: exposure up to short_us, gain up to its limit, exposure
// up to max_us. Gain steps count as even steps of brightness. Cameras do not guarantee this; the loop
// requires only that more gain is brighter. Capture thread; no heap call.
class AutoExposure {
 public:
  AutoExposure(const ExposureOptions& options, const ExposureRange& range);

  // Returns the setting to use from now on. It changes only where the image is clearly off its target, at
  // most every kSettleFrames images.
  [[nodiscard]] ExposureSetting update(double mean_grey);
  [[nodiscard]] ExposureSetting setting() const;

  static constexpr int kSettleFrames = 4;  // longest delay from a setting to an image that shows it

 private:
  ExposureOptions options_;
  ExposureRange range_;
  double log_min_ = 0, log_short_ = 0, log_max_ = 0;  // logarithms to base 2 of the exposures
  double gain_stops_ = 0;                             // length of the gain's stretch
  double demand_stops_ = 0;                           // 0: darkest
  int frames_since_change_ = 0;
};

}  // namespace farpoint::drivers
