#include "drivers/libcamera_camera.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>

#include "drivers/pixel_conversion.h"

namespace farpoint::drivers {
namespace {

// Cheapest first. libcamera does not say what rate a format reaches, so that this alone decides.
constexpr std::array kFormats = {CameraFormat::kGrey, CameraFormat::kNv12, CameraFormat::kYuyv,
                                 CameraFormat::kMjpeg};
constexpr double kMicros = 1e6;

}  // namespace

LibcameraCamera::LibcameraCamera(const CameraOptions& options, std::unique_ptr<LibcameraSystem> system,
                                 std::unique_ptr<CameraWait> wait)
    : options_(options), system_(std::move(system)), wait_(std::move(wait)), intake_(options) {}

LibcameraCamera::~LibcameraCamera() {
  close();
}

std::string LibcameraCamera::check(const std::string& name) {
  const bool other_driver =
      name.starts_with("/dev/") || name.starts_with("by-id:") || name.starts_with("usb:");
  if (!name.empty() && !other_driver) return "";
  return "'" + name +
         "' names no camera of libcamera's, expected its id (cam -l lists them) or a number (0: "
         "the first of that list)";
}

bool LibcameraCamera::next(int timeout_ms, ipc::GreyImage* image, CameraFrame* frame) {
  if (!is_streaming()) {
    if (const int until_try_ms = search_.wait_ms(now_us()); until_try_ms > 0) {
      wait_->wait(-1, std::min(timeout_ms, until_try_ms));
      return false;
    }
    if (!open()) return false;
  }
  take_new_exposure();
  wait_->wait(finished_.fd(), timeout_ms);
  return take_frame(image, frame);
}

// --- coming and going

bool LibcameraCamera::open() {
  const char* what = "";
  if (const int status = system_->open(options_.device.c_str(), &finished_, &what); status < 0) {
    const bool absent = status == -ENOENT || status == -ENODEV;
    leave(absent ? CameraEvent::Kind::kAbsent : CameraEvent::Kind::kRefused, what, status);
    return false;
  }
  if (const int status = set_up(&what); status < 0) {
    const bool gone = status == -ENODEV || finished_.was_removed();
    leave(gone ? CameraEvent::Kind::kAbsent : CameraEvent::Kind::kRefused, what, status);
    return false;
  }
  ++intake_.counts.opened;
  intake_.start_stream();
  last_frame_us_ = now_us();
  streaming_.store(true, std::memory_order_relaxed);
  const double rate_hz = stream_.has_frame_duration ? options_.rate_hz : 0.0;
  search_.found(
      {CameraEvent::Kind::kStreaming, "", 0, format_, rate_hz, exposure_.exposure_us().has_value()});
  return true;
}

int LibcameraCamera::set_up(const char** what) {
  if (const int status = agree_on_format(what); status < 0) return status;
  LibcameraSetting first = exposure_.start(options_.exposure, stream_);
  if (stream_.has_frame_duration && options_.rate_hz > 0.0)
    first.frame_duration_us = std::llround(kMicros / options_.rate_hz);
  next_setting_ = {};
  return system_->start(first, what);
}

int LibcameraCamera::agree_on_format(const char** what) {
  for (const CameraFormat format : kFormats) {
    if (options_.format != CameraFormat::kAuto && options_.format != format) continue;
    const int status =
        system_->configure(format, options_.width_px, options_.height_px, options_.buffers, &stream_, what);
    if (status == -ENOTSUP) continue;
    format_ = format;
    return status;
  }
  *what = "it does not give images of the calibration's size in GREY (R8), NV12, YUYV or MJPEG";
  return -ENOTSUP;
}

void LibcameraCamera::close() {
  system_->close();
  finished_.clear();
  streaming_.store(false, std::memory_order_relaxed);
}

void LibcameraCamera::leave(CameraEvent::Kind kind, const char* what, int status) {
  close();
  search_.failed(kind, what, status, now_us());
}

void LibcameraCamera::lose(const char* what, int status) {
  ++intake_.counts.lost;
  leave(CameraEvent::Kind::kLost, what, status);
}

// --- frames

bool LibcameraCamera::take_frame(ipc::GreyImage* image, CameraFrame* frame) {
  if (finished_.was_removed()) {
    lose("it was removed", -ENODEV);
    return false;
  }
  std::uint32_t request = 0;
  if (finished_.take(&request)) return take_request(request, image, frame);
  if (now_us() - last_frame_us_ < static_cast<std::int64_t>(kMicros * options_.stall_s)) return false;
  ++intake_.counts.stalled;
  leave(CameraEvent::Kind::kStalled, "no image came, the stream is started anew", -ETIMEDOUT);
  return false;
}

bool LibcameraCamera::take_request(std::uint32_t request, ipc::GreyImage* image, CameraFrame* frame) {
  LibcameraFrame finished;
  system_->read(request, &finished);
  if (finished.status == LibcameraFrame::Status::kCancelled) {
    lose("its requests were cancelled", -EIO);
    return false;
  }
  last_frame_us_ = now_us();
  const bool usable = intake_.take(describe(finished), wait_->clocks(), image, frame);
  if (const int status = system_->give_back(request, next_setting_); status < 0) {
    lose("it takes no more requests", status);
    return usable;
  }
  next_setting_ = {};
  search_.works();
  if (usable && exposure_.needs_brightness())
    next_setting_ = exposure_.update(mean_grey(*image)).value_or(LibcameraSetting{});
  return usable;
}

RawFrame LibcameraCamera::describe(const LibcameraFrame& finished) const {
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

void LibcameraCamera::take_new_exposure() {
  if (new_exposure_.take(&options_.exposure)) next_setting_ = exposure_.start(options_.exposure, stream_);
}

}  // namespace farpoint::drivers
