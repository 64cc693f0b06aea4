// Exposure and gain of a V4L2 camera, by whichever of the controls it has.
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
  // Asks the camera what it can do, and sets what the options want.
  void start(V4l2System* system, int fd, const ExposureOptions& options);
  // After each image: what the automatic wants of the next ones. Does not wait for the camera, which may take
  // some images to follow.
  void update(double mean_grey);

  // Of the images to come; nothing where the camera does not say.
  [[nodiscard]] std::optional<double> exposure_us() const { return exposure_us_; }
  [[nodiscard]] std::optional<int> gain() const { return gain_; }
  [[nodiscard]] bool needs_brightness() const { return automatic_.has_value(); }

 private:
  [[nodiscard]] bool query(std::uint32_t id, std::int64_t* min, std::int64_t* max);
  bool set(std::uint32_t id, std::int64_t value);
  [[nodiscard]] std::optional<std::int64_t> get(std::uint32_t id);
  void leave_to_camera();
  [[nodiscard]] bool take_manual_control();
  // As the camera takes it: exposure, and gain where it has one.
  [[nodiscard]] std::span<const ControlValue> controls_for(const ExposureSetting& setting);
  void note(const ControlValue& control);
  void apply(const ExposureSetting& setting);

  V4l2System* system_ = nullptr;
  int fd_ = -1;
  bool has_gain_ = false;
  ExposureRange range_;
  ExposureSetting applied_;
  bool under_way_ = false;  // the camera has not taken applied_ yet
  std::array<ControlValue, ControlWriter::kMost> controls_;
  std::optional<AutoExposure> automatic_;
  std::optional<double> exposure_us_;
  std::optional<int> gain_;
};

}  // namespace farpoint::drivers
