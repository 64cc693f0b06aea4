// SPDX-License-Identifier: Apache-2.0
// A live camera over any CameraDevice. Opens it, streams from it, and searches it again after a loss or a
// stall.
#pragma once

#include <atomic>
#include <memory>

#include "drivers/camera/camera.h"
#include "drivers/camera/camera_device.h"
#include "drivers/camera/camera_search.h"
#include "drivers/camera/camera_wait.h"
#include "drivers/camera/exposure_mailbox.h"
#include "drivers/camera/frame_intake.h"

namespace farpoint::drivers {

class LiveCamera final : public Camera {
 public:
  // Does not open the device: an absent camera is no error.
  LiveCamera(const CameraOptions& options, std::unique_ptr<CameraDevice> device,
             std::unique_ptr<CameraWait> wait = std::make_unique<CameraWait>());

  [[nodiscard]] bool next(int timeout_ms, ipc::GreyImage* image, CameraFrame* frame) override;
  [[nodiscard]] bool is_streaming() const override { return streaming_; }
  [[nodiscard]] const CameraCounts& counts() const override { return intake_.counts; }
  void on_event(std::function<void(const CameraEvent&)> listener) override {
    search_.on_event(std::move(listener));
  }
  [[nodiscard]] std::int64_t opening_since_us() const override {
    return opening_since_us_.load(std::memory_order_relaxed);
  }
  void set_exposure(const ExposureOptions& options) override { new_exposure_.put(options); }

 private:
  class OpeningScope;
  bool open();
  void leave(const CameraEvent& reason);
  void lose(const char* what, int status);
  void leave_if_stalled();
  void take_new_exposure();
  [[nodiscard]] bool take_frame(ipc::GreyImage* image, CameraFrame* frame);
  [[nodiscard]] std::int64_t now_us() { return wait_->clocks().monotonic_us; }

  std::unique_ptr<CameraDevice> device_;
  std::unique_ptr<CameraWait> wait_;
  CameraSearch search_;
  FrameIntake intake_;
  ExposureMailbox new_exposure_;
  std::atomic<std::int64_t> opening_since_us_{kNotOpening};
  bool streaming_ = false;
  std::int64_t stall_us_;
  std::int64_t last_frame_us_ = 0;  // time of the last frame
};

}  // namespace farpoint::drivers
