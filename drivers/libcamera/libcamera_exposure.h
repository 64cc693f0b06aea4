// Exposure and gain of a libcamera camera: which controls the next requests carry.
#pragma once

#include <optional>

#include "drivers/libcamera/libcamera_system.h"

namespace farpoint::drivers {

class LibcameraExposure {
 public:
  // What the first request is to carry.
  [[nodiscard]] LibcameraSetting start(const ExposureOptions& options, const LibcameraStream& stream);
  // After each image; nothing where all stays as it is.
  [[nodiscard]] std::optional<LibcameraSetting> update(double mean_grey);
  [[nodiscard]] bool needs_brightness() const { return automatic_.has_value(); }

  // As set last; nothing where the camera does as it likes.
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
