// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/live_camera.h"

#include <algorithm>
#include <cerrno>

namespace farpoint::drivers {
namespace {

constexpr double kMicros = 1e6;

}  // namespace

// Marks the calls that may block for seconds: opening and closing the device.
class LiveCamera::OpeningScope {
 public:
  explicit OpeningScope(LiveCamera* camera) : since_us_(camera->opening_since_us_) {
    since_us_.store(camera->now_us(), std::memory_order_relaxed);
  }
  ~OpeningScope() { since_us_.store(kNotOpening, std::memory_order_relaxed); }
  OpeningScope(const OpeningScope&) = delete;
  OpeningScope& operator=(const OpeningScope&) = delete;

 private:
  std::atomic<std::int64_t>& since_us_;
};

LiveCamera::LiveCamera(const CameraOptions& options, std::unique_ptr<CameraDevice> device,
                       std::unique_ptr<CameraWait> wait)
    : device_(std::move(device)),
      wait_(std::move(wait)),
      intake_(options),
      stall_us_(static_cast<std::int64_t>(kMicros * options.stall_s)) {}

bool LiveCamera::next(int timeout_ms, ipc::GreyImage* image, CameraFrame* frame) {
  if (!streaming_) {
    if (const int until_try_ms = search_.wait_ms(now_us()); until_try_ms > 0) {
      wait_->wait(-1, std::min(timeout_ms, until_try_ms));
      return false;
    }
    if (!open()) return false;
  }
  take_new_exposure();
  wait_->wait(device_->fd(), timeout_ms);
  return take_frame(image, frame);
}

// --- coming and going

bool LiveCamera::open() {
  const CameraEvent outcome = [this] {
    const OpeningScope scope(this);
    return device_->open();
  }();
  if (outcome.kind != CameraEvent::Kind::kStreaming) {
    leave(outcome);
    return false;
  }
  ++intake_.counts.opened;
  intake_.start_stream();
  last_frame_us_ = now_us();
  streaming_ = true;
  search_.found(outcome);
  return true;
}

void LiveCamera::leave(const CameraEvent& reason) {
  {
    const OpeningScope scope(this);
    device_->close();
  }
  streaming_ = false;
  search_.failed(reason, now_us());
}

void LiveCamera::lose(const char* what, int status) {
  ++intake_.counts.lost;
  leave({CameraEvent::Kind::kLost, what, -status});
}

void LiveCamera::leave_if_stalled() {
  if (now_us() - last_frame_us_ < stall_us_) return;
  ++intake_.counts.stalled;
  leave({CameraEvent::Kind::kStalled, "no image came, the stream is started anew", ETIMEDOUT});
}

// --- frames

bool LiveCamera::take_frame(ipc::GreyImage* image, CameraFrame* frame) {
  RawFrame raw;
  const char* what = "";
  const int taken = device_->take(&raw, &what);
  if (taken == -EAGAIN) {
    leave_if_stalled();
    return false;
  }
  if (taken < 0) {
    lose(what, taken);
    return false;
  }
  const ClockReadings now = wait_->clocks();
  last_frame_us_ = now.monotonic_us;
  const bool usable = intake_.take(raw, now, image, frame);
  if (const int status = device_->give_back(&what); status < 0) {
    lose(what, status);
    return usable;
  }
  search_.works();
  if (usable) device_->adapt_exposure(*image);
  return usable;
}

void LiveCamera::take_new_exposure() {
  if (ExposureOptions wanted; new_exposure_.take(&wanted)) device_->set_exposure(wanted);
}

}  // namespace farpoint::drivers
