// A camera by V4L2: found, opened, agreed with, streamed from, and found again when it was away.
#pragma once

#include <atomic>
#include <memory>
#include <optional>

#include "drivers/camera.h"
#include "drivers/camera_path.h"
#include "drivers/camera_search.h"
#include "drivers/exposure_mailbox.h"
#include "drivers/frame_intake.h"
#include "drivers/v4l2_controls.h"
#include "drivers/v4l2_stream.h"

namespace farpoint::drivers {

class V4l2Camera final : public Camera {
 public:
  // Opens nothing yet: a camera that is not there is no mistake. `root`: see CameraPath.
  V4l2Camera(const CameraOptions& options, std::unique_ptr<V4l2System> system, const std::string& root = "");
  ~V4l2Camera() override;
  V4l2Camera(const V4l2Camera&) = delete;
  V4l2Camera& operator=(const V4l2Camera&) = delete;

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
  void close();
  void leave(CameraEvent::Kind kind, const char* what, int status);
  [[nodiscard]] bool take_frame(ipc::GreyImage* image, CameraFrame* frame);
  [[nodiscard]] RawFrame describe(const V4l2Buffer& buffer) const;
  [[nodiscard]] std::optional<StampPoint> stamp_point(std::uint32_t flags) const;
  void take_new_exposure();
  [[nodiscard]] std::int64_t now_us() { return system_->clocks().monotonic_us; }

  CameraOptions options_;
  std::unique_ptr<V4l2System> system_;
  CameraPath path_;
  CameraSearch search_;
  FrameIntake intake_;
  V4l2Node node_;
  AgreedFormat agreed_;
  std::optional<V4l2Stream> stream_;
  V4l2Exposure exposure_;
  std::atomic<bool> streaming_{false};
  ExposureMailbox new_exposure_;
  std::int64_t last_frame_us_ = 0;  // when the stream last gave anything
};

}  // namespace farpoint::drivers
