// SPDX-License-Identifier: Apache-2.0
#include "drivers/libcamera/libcamera_exposure.h"

#include <algorithm>
#include <cmath>

namespace farpoint::drivers {

LibcameraSetting LibcameraExposure::start(const ExposureOptions& options, const LibcameraStream& stream) {
  *this = {};
  stream_ = stream;
  LibcameraSetting setting;
  const bool leave = options.mode == ExposureMode::kCamera || !stream.has_exposure;
  if (leave) {
    if (stream.has_auto_exposure) setting.auto_exposure = true;
    return setting;
  }
  if (options.mode == ExposureMode::kManual) {
    setting = apply({options.manual_us, options.manual_gain});
  } else {
    automatic_.emplace(options, stream.range);
    setting = apply(automatic_->setting());
  }
  if (stream.has_auto_exposure) setting.auto_exposure = false;
  return setting;
}

LibcameraSetting LibcameraExposure::apply(const ExposureSetting& wanted) {
  applied_ = wanted;
  LibcameraSetting setting;
  const double exposure_us = std::clamp(wanted.exposure_us, stream_.range.min_us, stream_.range.max_us);
  setting.exposure_us = static_cast<std::int32_t>(std::lround(exposure_us));
  exposure_us_ = *setting.exposure_us;
  if (stream_.has_gain) {
    setting.gain = std::clamp(wanted.gain, stream_.range.gain_min, stream_.range.gain_max);
    gain_ = setting.gain;
  }
  return setting;
}

std::optional<LibcameraSetting> LibcameraExposure::update(double mean_grey) {
  // A request with a new setting stands behind all that are queued; AutoExposure knows only the camera's
  // delay.
  if (!automatic_ || images_to_wait_-- > 0) return std::nullopt;
  images_to_wait_ = 0;
  const ExposureSetting wanted = automatic_->update(mean_grey);
  if (wanted == applied_) return std::nullopt;
  images_to_wait_ = stream_.requests;
  return apply(wanted);
}

}  // namespace farpoint::drivers
