#include "drivers/v4l2_camera.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "drivers/pixel_conversion.h"

namespace farpoint::drivers {
namespace {

constexpr std::int64_t kMicrosPerMilli = 1000;

}  // namespace

V4l2Camera::V4l2Camera(const CameraOptions& options, std::unique_ptr<V4l2System> system,
                       const std::string& root)
    : options_(options),
      system_(std::move(system)),
      path_(options.device, root),
      tell_([](const CameraEvent&) {}) {}

V4l2Camera::~V4l2Camera() {
  close();
}

bool V4l2Camera::next(int timeout_ms, ipc::GreyImage* image, CameraFrame* frame) {
  if (!is_streaming()) {
    const std::int64_t until_try_us = next_try_us_ - now_us();
    if (until_try_us > 0) {
      // One more: what is left of a millisecond must not become a busy loop.
      const auto until_try_ms = static_cast<int>(until_try_us / kMicrosPerMilli) + 1;
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
  ++counts_.opened;
  last_driver_sequence_.reset();
  last_frame_us_ = now_us();
  streaming_.store(true, std::memory_order_relaxed);
  said_ = CameraEvent::Kind::kStreaming;
  tell_({CameraEvent::Kind::kStreaming, "", 0, agreed_.format, agreed_.rate_hz,
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
  if (kind != said_) tell_({kind, what, -status, CameraFormat::kAuto, 0.0, false});
  said_ = kind;
  retry_later();
}

void V4l2Camera::retry_later() {
  next_try_us_ = now_us() + retry_us_;
  retry_us_ = std::min(2 * retry_us_, kLongestRetry_us);
}

// --- frames

bool V4l2Camera::take_frame(ipc::GreyImage* image, CameraFrame* frame) {
  V4l2Buffer buffer;
  int status = stream_->take(&buffer);
  if (status == -EAGAIN) {
    if (now_us() - last_frame_us_ < static_cast<std::int64_t>(1e6 * options_.stall_s)) return false;
    ++counts_.stalled;
    leave(CameraEvent::Kind::kStalled, "no image came, the stream is started anew", -ETIMEDOUT);
    return false;
  }
  bool usable = false;
  if (status >= 0) {
    last_frame_us_ = now_us();
    usable = use(buffer, image, frame);
    status = stream_->give_back(buffer);
  }
  if (status < 0) {
    ++counts_.lost;
    leave(CameraEvent::Kind::kLost, "its stream has ended", status);
  } else {
    retry_us_ = kFirstRetry_us;  // it gives images: the next loss is a new story
  }
  if (usable && exposure_.needs_brightness() && is_streaming()) exposure_.update(mean_grey(*image));
  return usable;
}

bool V4l2Camera::use(const V4l2Buffer& buffer, ipc::GreyImage* image, CameraFrame* frame) {
  count_sequence(buffer.sequence);
  if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0) {
    ++counts_.flagged;
    return false;
  }
  const std::int64_t utime = time_of(buffer);
  if (utime <= last_utime_) {
    ++counts_.times_backwards;
    return false;
  }
  if (!convert(buffer, image)) {
    ++counts_.undecodable;
    return false;
  }
  last_utime_ = utime;
  ++counts_.frames;
  frame->utime = utime;
  frame->sequence = sequence_;
  frame->exposure_us = static_cast<std::int32_t>(exposure_.exposure_us().value_or(-1.0));
  frame->gain = static_cast<float>(exposure_.gain().value_or(-1));
  return true;
}

bool V4l2Camera::convert(const V4l2Buffer& buffer, ipc::GreyImage* image) {
  const PixelLayout layout{options_.width_px, options_.height_px, agreed_.row_stride};
  switch (agreed_.format) {
    case CameraFormat::kGrey:
    case CameraFormat::kNv12:
      return grey_rows_to_grey(buffer.bytes, layout, image);
    case CameraFormat::kYuyv:
      return yuyv_to_grey(buffer.bytes, layout, image);
    case CameraFormat::kMjpeg:
      return decoder_.decode_jpeg(buffer.bytes, options_.width_px, options_.height_px, image) ==
             ipc::ImageStatus::kOk;
    case CameraFormat::kAuto:
      break;
  }
  return false;
}

// The driver's numbers start anew with each stream; ours go on.
void V4l2Camera::count_sequence(std::uint32_t sequence) {
  constexpr std::uint32_t kLargestGap = 1000;  // more is a driver that counts otherwise
  std::uint32_t step = last_driver_sequence_ ? sequence - *last_driver_sequence_ : 1;
  if (step == 0 || step > kLargestGap) step = 1;
  counts_.missing += step - 1;
  sequence_ += step;
  last_driver_sequence_ = sequence;
}

std::int64_t V4l2Camera::time_of(const V4l2Buffer& buffer) {
  const double exposure_us = exposure_.exposure_us().value_or(-1.0);
  const ClockReadings now = system_->clocks();
  const SourceClock clock = detect_clock(buffer.stamp_us, now);
  if (clock == SourceClock::kUnknown) {
    ++counts_.times_unknown;
    return now.monotonic_us + options_.time_offset_us +
           mid_exposure_shift_us(StampPoint::kEndOfFrame, exposure_us, options_.readout_s);
  }
  const std::int64_t stamp_us = to_monotonic(buffer.stamp_us, clock, now) + options_.time_offset_us;
  // A loopback device hands on its writer's time, which is the image's already.
  const bool copied = (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_COPY;
  if (copied && options_.stamp_point == StampPoint::kAuto) return stamp_us;
  return stamp_us + mid_exposure_shift_us(stamp_point(buffer.flags), exposure_us, options_.readout_s);
}

StampPoint V4l2Camera::stamp_point(std::uint32_t flags) const {
  if (options_.stamp_point != StampPoint::kAuto) return options_.stamp_point;
  if ((flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) != V4L2_BUF_FLAG_TSTAMP_SRC_SOE) return StampPoint::kEndOfFrame;
  // It stamps the first packet of an image, which a camera sends when the exposure is over.
  const bool uvc = std::strcmp(node_.driver.data(), "uvcvideo") == 0;
  return uvc ? StampPoint::kStartOfReadout : StampPoint::kStartOfExposure;
}

// --- exposure

void V4l2Camera::set_exposure(const ExposureOptions& options) {
  const std::lock_guard lock(exposure_mutex_);
  new_exposure_ = options;
  has_new_exposure_.store(true, std::memory_order_release);
}

void V4l2Camera::take_new_exposure() {
  if (!has_new_exposure_.load(std::memory_order_acquire)) return;
  const std::unique_lock lock(exposure_mutex_, std::try_to_lock);
  if (!lock.owns_lock()) return;
  has_new_exposure_.store(false, std::memory_order_relaxed);
  options_.exposure = new_exposure_;
  exposure_.start(system_.get(), node_.fd, options_.exposure);
}

}  // namespace farpoint::drivers
