// SPDX-License-Identifier: Apache-2.0
// Chooses the exposure and gain controls of the next requests of a libcamera camera.
#pragma once

#include <optional>

#include "drivers/libcamera/libcamera_system.h"

namespace farpoint::drivers {

class LibcameraExposure {
 public:
  // Controls of the first request.
  [[nodiscard]] LibcameraSetting start(const ExposureOptions& options, const LibcameraStream& stream);
  // Call after each image. Returns empty where nothing changes.
  [[nodiscard]] std::optional<LibcameraSetting> update(double mean_grey);
  [[nodiscard]] bool needs_brightness() const { return automatic_.has_value(); }

  // As set last; empty under the camera's automatic.
  [[nodiscard]] std::optional<double> exposure_us() const { return exposure_us_; }
  [[nodiscard]] std::optional<int> gain() const { return gain_; }

 private:
  [[nodiscard]] LibcameraSetting apply(const ExposureSetting& wanted);

  LibcameraStream stream_;
  ExposureSetting applied_;
  std::optional<AutoExposure> automatic_;
  int images_to_wait_ = 0;  // until images show the last setting
  std::optional<double> exposure_us_;
  std::optional<int> gain_;
};

}  // namespace farpoint::drivers
