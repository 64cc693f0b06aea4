// A camera by libcamera: found, agreed with, streamed from, and found again when it was away.
//
// libcamera's signals arrive on a thread of its own and only pass on the number of the finished request
// (finished_requests.h); all else is the capture thread's, whose one wait is for that. Frames are copied
// once, out of buffers that were mapped when the stream began, and the request is queued again at once.
//
// Heap: while it streams this makes no heap call after the first images. libcamera itself does, on the
// calling thread, when a request is queued again: it empties and fills lists of controls, and sends its own
// thread a message, under a mutex of its own that is held for some instructions. Finding and starting a
// camera allocates, and may take as long as libcamera needs to look through all devices.
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "drivers/camera.h"
#include "drivers/camera_search.h"
#include "drivers/camera_wait.h"
#include "drivers/exposure_mailbox.h"
#include "drivers/frame_intake.h"
#include "drivers/libcamera_exposure.h"
#include "drivers/libcamera_system.h"

namespace farpoint::drivers {

class LibcameraCamera final : public Camera {
 public:
  // Opens nothing yet: a camera that is not there is no mistake.
  LibcameraCamera(const CameraOptions& options, std::unique_ptr<LibcameraSystem> system,
                  std::unique_ptr<CameraWait> wait = std::make_unique<CameraWait>());
  ~LibcameraCamera() override;
  LibcameraCamera(const LibcameraCamera&) = delete;
  LibcameraCamera& operator=(const LibcameraCamera&) = delete;

  // "" where options.device can name a camera of libcamera's, else what is wrong and what was expected.
  [[nodiscard]] static std::string check(const std::string& name);

  [[nodiscard]] bool next(int timeout_ms, ipc::GreyImage* image, CameraFrame* frame) override;
  [[nodiscard]] bool is_streaming() const override { return streaming_.load(std::memory_order_relaxed); }
  [[nodiscard]] const CameraCounts& counts() const override { return intake_.counts; }
  void on_event(std::function<void(const CameraEvent&)> listener) override {
    search_.on_event(std::move(listener));
  }
  void set_exposure(const ExposureOptions& options) override { new_exposure_.put(options); }

 private:
  bool open();
  [[nodiscard]] int set_up(const char** what);
  [[nodiscard]] int agree_on_format(const char** what);
  void close();
  void leave(CameraEvent::Kind kind, const char* what, int status);
  void lose(const char* what, int status);
  [[nodiscard]] bool take_frame(ipc::GreyImage* image, CameraFrame* frame);
  [[nodiscard]] bool take_request(std::uint32_t request, ipc::GreyImage* image, CameraFrame* frame);
  [[nodiscard]] RawFrame describe(const LibcameraFrame& finished) const;
  void take_new_exposure();
  [[nodiscard]] std::int64_t now_us() { return wait_->clocks().monotonic_us; }

  CameraOptions options_;
  std::unique_ptr<LibcameraSystem> system_;
  std::unique_ptr<CameraWait> wait_;
  CameraSearch search_;
  FrameIntake intake_;
  FinishedRequests finished_;
  LibcameraStream stream_;
  CameraFormat format_ = CameraFormat::kAuto;
  LibcameraExposure exposure_;
  LibcameraSetting next_setting_;  // for the next request that is queued
  std::atomic<bool> streaming_{false};
  std::int64_t last_frame_us_ = 0;  // when the stream last gave anything
  ExposureMailbox new_exposure_;
};

}  // namespace farpoint::drivers
