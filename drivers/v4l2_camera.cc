#include "drivers/v4l2_camera.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "drivers/pixel_conversion.h"

namespace farpoint::drivers {

V4l2Camera::V4l2Camera(const CameraOptions& options, std::unique_ptr<V4l2System> system,
                       const std::string& root)
    : options_(options), system_(std::move(system)), path_(options.device, root), intake_(options) {}

V4l2Camera::~V4l2Camera() {
  close();
}

bool V4l2Camera::next(int timeout_ms, ipc::GreyImage* image, CameraFrame* frame) {
  if (!is_streaming()) {
    if (const int until_try_ms = search_.wait_ms(now_us()); until_try_ms > 0) {
      (void)system_->wait(-1, std::min(timeout_ms, until_try_ms));
      return false;
    }
    if (!open()) return false;
  }
  take_new_exposure();
  (void)system_->wait(node_.fd, timeout_ms);
  return take_frame(image, frame);
}

// --- coming and going

bool V4l2Camera::open() {
  const char* path = path_.find();
  const int fd = path == nullptr ? -ENOENT : system_->open(path);
  if (fd < 0) {
    // A node that has just appeared belongs to root until udev has been there: not refused, only not there
    // yet.
    leave(CameraEvent::Kind::kAbsent, "it cannot be opened", fd);
    return false;
  }
  node_ = {};
  node_.fd = fd;
  const char* what = "";
  if (const int status = set_up(&what); status < 0) {
    const bool gone = status == -ENODEV || status == -ENXIO;
    leave(gone ? CameraEvent::Kind::kAbsent : CameraEvent::Kind::kRefused, what, status);
    return false;
  }
  ++intake_.counts.opened;
  intake_.start_stream();
  last_frame_us_ = now_us();
  streaming_.store(true, std::memory_order_relaxed);
  search_.found({CameraEvent::Kind::kStreaming, "", 0, agreed_.format, agreed_.rate_hz,
                 exposure_.exposure_us().has_value()});
  return true;
}

int V4l2Camera::set_up(const char** what) {
  int status = identify(system_.get(), &node_, what);
  if (status >= 0) status = agree_on_format(system_.get(), node_, options_, &agreed_, what);
  if (status < 0) return status;
  exposure_.start(system_.get(), node_.fd, options_.exposure);
  stream_.emplace(system_.get(), node_);
  return stream_->start(options_.buffers, what);
}

void V4l2Camera::close() {
  stream_.reset();
  if (node_.fd >= 0) system_->close(node_.fd);
  node_.fd = -1;
  streaming_.store(false, std::memory_order_relaxed);
}

void V4l2Camera::leave(CameraEvent::Kind kind, const char* what, int status) {
  close();
  search_.failed(kind, what, status, now_us());
}

// --- frames

bool V4l2Camera::take_frame(ipc::GreyImage* image, CameraFrame* frame) {
  V4l2Buffer buffer;
  int status = stream_->take(&buffer);
  if (status == -EAGAIN) {
    if (now_us() - last_frame_us_ < static_cast<std::int64_t>(1e6 * options_.stall_s)) return false;
    ++intake_.counts.stalled;
    leave(CameraEvent::Kind::kStalled, "no image came, the stream is started anew", -ETIMEDOUT);
    return false;
  }
  bool usable = false;
  if (status >= 0) {
    last_frame_us_ = now_us();
    usable = intake_.take(describe(buffer), system_->clocks(), image, frame);
    status = stream_->give_back(buffer);
  }
  if (status < 0) {
    ++intake_.counts.lost;
    leave(CameraEvent::Kind::kLost, "its stream has ended", status);
  } else {
    search_.works();
  }
  if (usable && exposure_.needs_brightness() && is_streaming()) exposure_.update(mean_grey(*image));
  return usable;
}

RawFrame V4l2Camera::describe(const V4l2Buffer& buffer) const {
  RawFrame raw;
  raw.bytes = buffer.bytes;
  raw.format = agreed_.format;
  raw.row_stride = agreed_.row_stride;
  raw.damaged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
  raw.sequence = buffer.sequence;
  raw.stamp_us = buffer.stamp_us;
  raw.stamp_point = stamp_point(buffer.flags);
  raw.exposure_us = exposure_.exposure_us().value_or(-1.0);
  raw.gain = static_cast<float>(exposure_.gain().value_or(-1));
  return raw;
}

std::optional<StampPoint> V4l2Camera::stamp_point(std::uint32_t flags) const {
  if (options_.stamp_point != StampPoint::kAuto) return options_.stamp_point;
  // A loopback device hands on its writer's time, which is the image's already.
  if ((flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_COPY) return std::nullopt;
  if ((flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) != V4L2_BUF_FLAG_TSTAMP_SRC_SOE) return StampPoint::kEndOfFrame;
  // It stamps the first packet of an image, which a camera sends when the exposure is over.
  const bool uvc = std::strcmp(node_.driver.data(), "uvcvideo") == 0;
  return uvc ? StampPoint::kStartOfReadout : StampPoint::kStartOfExposure;
}

// --- exposure

void V4l2Camera::take_new_exposure() {
  if (new_exposure_.take(&options_.exposure)) exposure_.start(system_.get(), node_.fd, options_.exposure);
}

}  // namespace farpoint::drivers
