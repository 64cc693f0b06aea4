// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/v4l2_controls.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <cmath>

namespace farpoint::drivers {
namespace {

constexpr double kExposureUnit_us = 100.0;  // of V4L2_CID_EXPOSURE_ABSOLUTE

}  // namespace

// --- set-up

void V4l2ExposureSetUp::prepare(V4l2System* system, int fd, const ExposureOptions& options) {
  system_ = system;
  fd_ = fd;
  options_ = options;
}

void V4l2ExposureSetUp::run() {
  state_ = {};
  // The exposure must not lower the frame rate, in every mode.
  set(V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0);
  if (options_.mode == ExposureMode::kCamera || !take_manual_control()) {
    leave_to_camera();
    return;
  }
  if (options_.mode == ExposureMode::kManual) {
    apply({options_.manual_us, options_.manual_gain});
    return;
  }
  state_.automatic.emplace(options_, state_.range);
  apply(state_.automatic->setting());
}

void V4l2ExposureSetUp::leave_to_camera() {
  // Cameras differ in which of the automatic modes they have.
  if (!set(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_AUTO))
    set(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY);
  set(V4L2_CID_AUTOGAIN, 1);
  // The camera changes it freely: the present value does not hold for later images.
  state_.exposure_us.reset();
}

bool V4l2ExposureSetUp::take_manual_control() {
  if (!set(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL) &&
      !set(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_SHUTTER_PRIORITY) && get(V4L2_CID_EXPOSURE_AUTO).has_value())
    return false;
  std::int64_t min = 0, max = 0;
  if (!query(V4L2_CID_EXPOSURE_ABSOLUTE, &min, &max)) return false;
  ExposureRange& range = state_.range;
  range.min_us = kExposureUnit_us * static_cast<double>(std::max<std::int64_t>(min, 1));
  range.max_us = kExposureUnit_us * static_cast<double>(std::max<std::int64_t>(max, 1));
  set(V4L2_CID_AUTOGAIN, 0);
  state_.has_gain = query(V4L2_CID_GAIN, &min, &max);
  if (state_.has_gain) {
    range.gain_min = static_cast<int>(min);
    range.gain_max = static_cast<int>(max);
  }
  return true;
}

void V4l2ExposureSetUp::apply(const ExposureSetting& setting) {
  V4l2ExposureWrite write;
  write.prepare(system_, fd_, state_, setting);
  write.run();
  write.note(&state_);
  state_.applied = setting;
}

bool V4l2ExposureSetUp::query(std::uint32_t id, std::int64_t* min, std::int64_t* max) {
  v4l2_queryctrl control{};
  control.id = id;
  if (system_->ioctl(fd_, VIDIOC_QUERYCTRL, &control) < 0) return false;
  if ((control.flags & (V4L2_CTRL_FLAG_DISABLED | V4L2_CTRL_FLAG_READ_ONLY)) != 0) return false;
  *min = control.minimum;
  *max = control.maximum;
  return control.maximum > control.minimum;
}

bool V4l2ExposureSetUp::set(std::uint32_t id, std::int64_t value) {
  v4l2_control control{id, static_cast<std::int32_t>(value)};
  return system_->ioctl(fd_, VIDIOC_S_CTRL, &control) >= 0;
}

std::optional<std::int64_t> V4l2ExposureSetUp::get(std::uint32_t id) {
  v4l2_control control{id, 0};
  if (system_->ioctl(fd_, VIDIOC_G_CTRL, &control) < 0) return std::nullopt;
  return control.value;
}

// --- one setting

void V4l2ExposureWrite::prepare(V4l2System* system, int fd, const V4l2ExposureState& state,
                                const ExposureSetting& setting) {
  const ExposureRange& range = state.range;
  const double exposure_us = std::clamp(setting.exposure_us, range.min_us, range.max_us);
  system_ = system;
  fd_ = fd;
  count_ = state.has_gain ? 2 : 1;
  controls_[0] = {V4L2_CID_EXPOSURE_ABSOLUTE,
                  static_cast<std::int32_t>(std::lround(exposure_us / kExposureUnit_us))};
  controls_[1] = {V4L2_CID_GAIN, std::clamp(setting.gain, range.gain_min, range.gain_max)};
}

void V4l2ExposureWrite::run() {
  for (Control& control : std::span(controls_).first(count_)) {
    v4l2_control argument{control.id, control.value};
    control.taken = system_->ioctl(fd_, VIDIOC_S_CTRL, &argument) >= 0;
  }
}

void V4l2ExposureWrite::note(V4l2ExposureState* state) const {
  for (const Control& control : std::span(controls_).first(count_)) {
    if (!control.taken) continue;
    if (control.id == V4L2_CID_EXPOSURE_ABSOLUTE) state->exposure_us = kExposureUnit_us * control.value;
    if (control.id == V4L2_CID_GAIN) state->gain = control.value;
  }
}

// --- a stream's exposure

void V4l2Exposure::start(V4l2System* system, int fd, const ExposureOptions& options) {
  system->wait_for_controls();
  running_ = Running::kNone;
  wanted_.reset();
  system_ = system;
  fd_ = fd;
  set_up_.prepare(system, fd, options);
  set_up_.run();
  state_ = set_up_.state();
}

void V4l2Exposure::restart(const ExposureOptions& options) {
  wanted_ = options;
  state_.exposure_us.reset();
  state_.gain.reset();
  poll();
}

void V4l2Exposure::begin_set_up() {
  set_up_.prepare(system_, fd_, *wanted_);
  if (!system_->start_controls(&set_up_)) return;
  wanted_.reset();
  running_ = Running::kSetUp;
}

void V4l2Exposure::poll() {
  if (running_ != Running::kNone) {
    if (!system_->finished_controls()) return;
    if (running_ == Running::kWrite && !wanted_) write_.note(&state_);
    if (running_ == Running::kSetUp) state_ = set_up_.state();
    running_ = Running::kNone;
  }
  if (wanted_) begin_set_up();
}

void V4l2Exposure::update(double mean_grey) {
  // Until a setting has been accepted the images show the one before: they must not be acted upon twice.
  if (!needs_brightness()) return;
  const ExposureSetting wanted = state_.automatic->update(mean_grey);
  if (wanted == state_.applied) return;
  write_.prepare(system_, fd_, state_, wanted);
  if (!system_->start_controls(&write_)) return;
  state_.applied = wanted;
  running_ = Running::kWrite;
}

}  // namespace farpoint::drivers
