// SPDX-License-Identifier: Apache-2.0
#include "drivers/libcamera/libcamera_device.h"

#include <array>
#include <cerrno>
#include <cmath>
#include <utility>

#include "drivers/camera/foreign_threads.h"
#include "drivers/camera/pixel_conversion.h"

namespace farpoint::drivers {
namespace {

// Cheapest first. libcamera does not say what rate a format reaches, so that this alone decides.
constexpr std::array kFormats = {CameraFormat::kGrey, CameraFormat::kNv12, CameraFormat::kYuyv,
                                 CameraFormat::kRgb24, CameraFormat::kMjpeg};
constexpr double kMicros = 1e6;

}  // namespace

LibcameraDevice::LibcameraDevice(const CameraOptions& options, std::unique_ptr<LibcameraSystem> system)
    : options_(options), system_(std::move(system)) {}

LibcameraDevice::~LibcameraDevice() {
  close();
}

std::string LibcameraDevice::check(const std::string& name) {
  const bool other_driver =
      name.starts_with("/dev/") || name.starts_with("by-id:") || name.starts_with("usb:");
  if (!name.empty() && !other_driver) return "";
  return "'" + name +
         "' names no camera of libcamera's, expected its id (cam -l lists them) or a number (0: "
         "the first of that list)";
}

// --- coming and going

CameraEvent LibcameraDevice::open() {
  using Kind = CameraEvent::Kind;
  limit_foreign_threads();  // libcamera starts some, and images pass through one of them
  const char* what = "";
  if (const int status = system_->open(options_.device.c_str(), &finished_, &what); status < 0) {
    const bool absent = status == -ENOENT || status == -ENODEV;
    return {absent ? Kind::kAbsent : Kind::kRefused, what, -status};
  }
  if (const int status = set_up(&what); status < 0) {
    const bool gone = status == -ENODEV || finished_.was_removed();
    return {gone ? Kind::kAbsent : Kind::kRefused, what, -status};
  }
  const double rate_hz = stream_.has_frame_duration ? options_.rate_hz : 0.0;
  return {Kind::kStreaming, "", 0, format_, rate_hz, exposure_.exposure_us().has_value()};
}

int LibcameraDevice::set_up(const char** what) {
  if (const int status = agree_on_format(what); status < 0) return status;
  LibcameraSetting first = exposure_.start(options_.exposure, stream_);
  if (stream_.has_frame_duration && options_.rate_hz > 0.0)
    first.frame_duration_us = std::llround(kMicros / options_.rate_hz);
  next_setting_ = {};
  return system_->start(first, what);
}

int LibcameraDevice::agree_on_format(const char** what) {
  for (const CameraFormat format : kFormats) {
    if (options_.format != CameraFormat::kAuto && options_.format != format) continue;
    const int status =
        system_->configure(format, options_.width_px, options_.height_px, options_.buffers, &stream_, what);
    if (status == -ENOTSUP) continue;
    format_ = format;
    return status;
  }
  *what =
      "it does not give images of the calibration's size in GREY (R8), NV12, YUYV, RGB24 (BGR888) or MJPEG";
  return -ENOTSUP;
}

void LibcameraDevice::close() {
  system_->close();
  finished_.clear();
}

// --- frames

int LibcameraDevice::take(RawFrame* raw, const char** what) {
  *what = "it was removed";
  if (finished_.was_removed()) return -ENODEV;
  if (!finished_.take(&taken_)) return -EAGAIN;
  LibcameraFrame finished;
  system_->read(taken_, &finished);
  *what = "its requests were cancelled";
  if (finished.status == LibcameraFrame::Status::kCancelled) return -EIO;
  *raw = describe(finished);
  return 0;
}

int LibcameraDevice::give_back(const char** what) {
  *what = "it takes no more requests";
  return system_->give_back(taken_, std::exchange(next_setting_, {}));
}

RawFrame LibcameraDevice::describe(const LibcameraFrame& finished) const {
  RawFrame raw;
  raw.bytes = finished.bytes;
  raw.format = format_;
  raw.row_stride = stream_.row_stride;
  raw.damaged = finished.status == LibcameraFrame::Status::kDamaged;
  raw.sequence = finished.sequence;
  raw.stamp_us = finished.stamp_us;
  // Documented as the start of the first row's exposure; what its handlers forward is when the first packet
  // or the start of the frame came from the sensor, and that exposure was over.
  raw.stamp_point =
      options_.stamp_point == StampPoint::kAuto ? StampPoint::kStartOfReadout : options_.stamp_point;
  raw.exposure_us = finished.exposure_us >= 0 ? finished.exposure_us : exposure_.exposure_us().value_or(-1.0);
  raw.gain = static_cast<float>(finished.gain >= 0 ? finished.gain : exposure_.gain().value_or(-1));
  return raw;
}

// --- exposure

void LibcameraDevice::adapt_exposure(const ipc::GreyImage& image) {
  if (!exposure_.needs_brightness()) return;
  next_setting_ = exposure_.update(mean_grey(image)).value_or(LibcameraSetting{});
}

void LibcameraDevice::set_exposure(const ExposureOptions& options) {
  options_.exposure = options;
  next_setting_ = exposure_.start(options_.exposure, stream_);
}

}  // namespace farpoint::drivers
