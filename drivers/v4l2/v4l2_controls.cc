// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/v4l2_controls.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <cmath>

namespace farpoint::drivers {
namespace {

constexpr double kExposureUnit_us = 100.0;  // of V4L2_CID_EXPOSURE_ABSOLUTE

}  // namespace

void V4l2Exposure::start(V4l2System* system, int fd, const ExposureOptions& options) {
  system->wait_for_controls();
  *this = {};
  system_ = system;
  fd_ = fd;
  // The exposure must not lower the frame rate, in every mode.
  set(V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0);
  if (options.mode == ExposureMode::kCamera || !take_manual_control()) {
    leave_to_camera();
    return;
  }
  if (options.mode == ExposureMode::kManual) {
    apply({options.manual_us, options.manual_gain});
    return;
  }
  automatic_.emplace(options, range_);
  apply(automatic_->setting());
}

void V4l2Exposure::leave_to_camera() {
  // Cameras differ in which of the automatic modes they have.
  if (!set(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_AUTO))
    set(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY);
  set(V4L2_CID_AUTOGAIN, 1);
  // The camera changes it freely: the present value does not hold for later images.
  exposure_us_.reset();
}

bool V4l2Exposure::take_manual_control() {
  if (!set(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL) &&
      !set(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_SHUTTER_PRIORITY) && get(V4L2_CID_EXPOSURE_AUTO).has_value())
    return false;
  std::int64_t min = 0, max = 0;
  if (!query(V4L2_CID_EXPOSURE_ABSOLUTE, &min, &max)) return false;
  range_.min_us = kExposureUnit_us * static_cast<double>(std::max<std::int64_t>(min, 1));
  range_.max_us = kExposureUnit_us * static_cast<double>(std::max<std::int64_t>(max, 1));
  set(V4L2_CID_AUTOGAIN, 0);
  has_gain_ = query(V4L2_CID_GAIN, &min, &max);
  if (has_gain_) {
    range_.gain_min = static_cast<int>(min);
    range_.gain_max = static_cast<int>(max);
  }
  return true;
}

std::span<const ControlValue> V4l2Exposure::controls_for(const ExposureSetting& setting) {
  const double exposure_us = std::clamp(setting.exposure_us, range_.min_us, range_.max_us);
  controls_[0] = {V4L2_CID_EXPOSURE_ABSOLUTE,
                  static_cast<std::int32_t>(std::lround(exposure_us / kExposureUnit_us))};
  controls_[1] = {V4L2_CID_GAIN, std::clamp(setting.gain, range_.gain_min, range_.gain_max)};
  return std::span(controls_).first(has_gain_ ? 2 : 1);
}

void V4l2Exposure::note(const ControlValue& control) {
  if (!control.taken) return;
  if (control.id == V4L2_CID_EXPOSURE_ABSOLUTE) exposure_us_ = kExposureUnit_us * control.value;
  if (control.id == V4L2_CID_GAIN) gain_ = control.value;
}

void V4l2Exposure::apply(const ExposureSetting& setting) {
  applied_ = setting;
  for (ControlValue control : controls_for(setting)) {
    control.taken = set(control.id, control.value);
    note(control);
  }
}

void V4l2Exposure::update(double mean_grey) {
  if (!automatic_) return;
  if (under_way_) {
    const auto finished = system_->finished_controls();
    // The images still show the setting before: what they say of it must not be acted upon twice.
    if (finished.empty()) return;
    for (const ControlValue& control : finished) note(control);
    under_way_ = false;
  }
  const ExposureSetting wanted = automatic_->update(mean_grey);
  if (wanted == applied_ || !system_->start_controls(fd_, controls_for(wanted))) return;
  applied_ = wanted;
  under_way_ = true;
}

bool V4l2Exposure::query(std::uint32_t id, std::int64_t* min, std::int64_t* max) {
  v4l2_queryctrl control{};
  control.id = id;
  if (system_->ioctl(fd_, VIDIOC_QUERYCTRL, &control) < 0) return false;
  if ((control.flags & (V4L2_CTRL_FLAG_DISABLED | V4L2_CTRL_FLAG_READ_ONLY)) != 0) return false;
  *min = control.minimum;
  *max = control.maximum;
  return control.maximum > control.minimum;
}

bool V4l2Exposure::set(std::uint32_t id, std::int64_t value) {
  v4l2_control control{id, static_cast<std::int32_t>(value)};
  return system_->ioctl(fd_, VIDIOC_S_CTRL, &control) >= 0;
}

std::optional<std::int64_t> V4l2Exposure::get(std::uint32_t id) {
  v4l2_control control{id, 0};
  if (system_->ioctl(fd_, VIDIOC_G_CTRL, &control) < 0) return std::nullopt;
  return control.value;
}

}  // namespace farpoint::drivers
