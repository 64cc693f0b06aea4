// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/v4l2_device.h"

#include <linux/videodev2.h>

#include <cerrno>
#include <cstring>

#include "drivers/camera/pixel_conversion.h"

namespace farpoint::drivers {
namespace {

constexpr const char* kEnded = "its stream has ended";

}  // namespace

V4l2Device::V4l2Device(const CameraOptions& options, std::unique_ptr<V4l2System> system,
                       const std::string& root)
    : options_(options), system_(std::move(system)), path_(options.device, root) {}

V4l2Device::~V4l2Device() {
  close();
}

// --- coming and going

CameraEvent V4l2Device::open() {
  using Kind = CameraEvent::Kind;
  const char* path = path_.find();
  const int fd = path == nullptr ? -ENOENT : system_->open(path);
  // A node that has just appeared belongs to root until udev has been there: not refused, only not there yet.
  if (fd < 0) return {Kind::kAbsent, "it cannot be opened", -fd};
  node_ = {};
  node_.fd = fd;
  const char* what = "";
  if (const int status = set_up(&what); status < 0) {
    const bool gone = status == -ENODEV || status == -ENXIO;
    return {gone ? Kind::kAbsent : Kind::kRefused, what, -status};
  }
  return {Kind::kStreaming, "", 0, agreed_.format, agreed_.rate_hz, exposure_.exposure_us().has_value()};
}

int V4l2Device::set_up(const char** what) {
  int status = identify(system_.get(), &node_, what);
  if (status >= 0) status = agree_on_format(system_.get(), node_, options_, &agreed_, what);
  if (status < 0) return status;
  exposure_.start(system_.get(), node_.fd, options_.exposure);
  stream_.emplace(system_.get(), node_);
  return stream_->start(options_.buffers, what);
}

void V4l2Device::close() {
  stream_.reset();
  if (node_.fd >= 0) system_->close(node_.fd);
  node_.fd = -1;
}

// --- frames

int V4l2Device::take(RawFrame* raw, const char** what) {
  *what = kEnded;
  if (const int status = stream_->take(&taken_); status < 0) return status;
  *raw = describe(taken_);
  return 0;
}

int V4l2Device::give_back(const char** what) {
  *what = kEnded;
  return stream_->give_back(taken_);
}

RawFrame V4l2Device::describe(const V4l2Buffer& buffer) const {
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

std::optional<StampPoint> V4l2Device::stamp_point(std::uint32_t flags) const {
  if (options_.stamp_point != StampPoint::kAuto) return options_.stamp_point;
  // A loopback device hands on its writer's time, which is the image's already.
  if ((flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_COPY) return std::nullopt;
  if ((flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) != V4L2_BUF_FLAG_TSTAMP_SRC_SOE) return StampPoint::kEndOfFrame;
  // It stamps the first packet of an image, which a camera sends when the exposure is over.
  const bool uvc = std::strcmp(node_.driver.data(), "uvcvideo") == 0;
  return uvc ? StampPoint::kStartOfReadout : StampPoint::kStartOfExposure;
}

// --- exposure

void V4l2Device::adapt_exposure(const ipc::GreyImage& image) {
  exposure_.poll();
  if (exposure_.needs_brightness()) exposure_.update(mean_grey(image));
}

void V4l2Device::set_exposure(const ExposureOptions& options) {
  options_.exposure = options;
  exposure_.restart(options_.exposure);
}

}  // namespace farpoint::drivers
