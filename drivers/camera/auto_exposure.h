// Exposure and gain from the brightness of the images, short exposures preferred: noise costs a tracker less
// than motion blur.
#pragma once

#include "drivers/camera/camera.h"

namespace farpoint::drivers {

// What a camera can do.
struct ExposureRange {
  double min_us = 100, max_us = 33000;
  int gain_min = 0, gain_max = 0;  // the camera's own steps; equal: it has no gain
};

struct ExposureSetting {
  double exposure_us = 0;
  int gain = 0;
  [[nodiscard]] bool operator==(const ExposureSetting&) const = default;
};

// One number, the demand, moves through three stretches: exposure from the shortest to short_us, gain from
// the least to its limit, exposure from short_us to max_us. Gain steps are taken as even steps of brightness,
// which no camera promises: the loop only needs them to be brighter.
class AutoExposure {
 public:
  AutoExposure(const ExposureOptions& options, const ExposureRange& range);

  // The setting to use from now on; changes only where the image is clearly off its target, and only as often
  // as the camera can follow.
  [[nodiscard]] ExposureSetting update(double mean_grey);
  [[nodiscard]] ExposureSetting setting() const;

  static constexpr int kSettleFrames = 4;  // a setting shows in the images so many frames later at most

 private:
  ExposureOptions options_;
  ExposureRange range_;
  double log_min_ = 0, log_short_ = 0, log_max_ = 0;  // logarithms to base 2 of the exposures
  double gain_stops_ = 0;                             // length of the gain's stretch
  double demand_stops_ = 0;                           // 0: darkest
  int frames_since_change_ = 0;
};

}  // namespace farpoint::drivers
