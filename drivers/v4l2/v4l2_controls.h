// SPDX-License-Identifier: Apache-2.0
// Sets exposure and gain of a V4L2 camera by the controls that it has. Capture thread.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/camera/auto_exposure.h"
#include "drivers/v4l2/v4l2_system.h"

namespace farpoint::drivers {

class V4l2Exposure {
 public:
  // Queries the camera's ranges and applies the options. May block.
  void start(V4l2System* system, int fd, const ExposureOptions& options);
  // Call after each image: runs the automatic exposure for the next ones. Does not wait for the camera, which
  // may follow some images later.
  void update(double mean_grey);

  // Of the next images; empty where the camera does not report it.
  [[nodiscard]] std::optional<double> exposure_us() const { return exposure_us_; }
  [[nodiscard]] std::optional<int> gain() const { return gain_; }
  [[nodiscard]] bool needs_brightness() const { return automatic_.has_value(); }

 private:
  [[nodiscard]] bool query(std::uint32_t id, std::int64_t* min, std::int64_t* max);
  bool set(std::uint32_t id, std::int64_t value);
  [[nodiscard]] std::optional<std::int64_t> get(std::uint32_t id);
  void leave_to_camera();
  [[nodiscard]] bool take_manual_control();
  // The setting in the camera's controls: exposure, and gain where it has one.
  [[nodiscard]] std::span<const ControlValue> controls_for(const ExposureSetting& setting);
  void note(const ControlValue& control);
  void apply(const ExposureSetting& setting);

  V4l2System* system_ = nullptr;
  int fd_ = -1;
  bool has_gain_ = false;
  ExposureRange range_;
  ExposureSetting applied_;
  bool under_way_ = false;  // applied_ is not set in the camera yet
  std::array<ControlValue, ControlWriter::kMost> controls_;
  std::optional<AutoExposure> automatic_;
  std::optional<double> exposure_us_;
  std::optional<int> gain_;
};

}  // namespace farpoint::drivers
