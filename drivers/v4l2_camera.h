// A camera by V4L2: found, opened, agreed with, streamed from, and found again when it was away.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>

#include "drivers/camera.h"
#include "drivers/camera_path.h"
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
  [[nodiscard]] const CameraCounts& counts() const override { return counts_; }
  void on_event(std::function<void(const CameraEvent&)> listener) override { tell_ = std::move(listener); }
  void set_exposure(const ExposureOptions& options) override;

 private:
  // Doubled from try to try.
  static constexpr std::int64_t kFirstRetry_us = 100'000, kLongestRetry_us = 1'000'000;

  bool open();
  [[nodiscard]] int set_up(const char** what);
  void close();
  void leave(CameraEvent::Kind kind, const char* what, int status);
  void retry_later();
  [[nodiscard]] bool take_frame(ipc::GreyImage* image, CameraFrame* frame);
  [[nodiscard]] bool use(const V4l2Buffer& buffer, ipc::GreyImage* image, CameraFrame* frame);
  [[nodiscard]] bool convert(const V4l2Buffer& buffer, ipc::GreyImage* image);
  void count_sequence(std::uint32_t sequence);
  [[nodiscard]] std::int64_t time_of(const V4l2Buffer& buffer);
  [[nodiscard]] StampPoint stamp_point(std::uint32_t flags) const;
  void take_new_exposure();
  [[nodiscard]] std::int64_t now_us() { return system_->clocks().monotonic_us; }

  CameraOptions options_;
  std::unique_ptr<V4l2System> system_;
  CameraPath path_;
  std::function<void(const CameraEvent&)> tell_;
  ipc::ImageDecoder decoder_;
  V4l2Node node_;
  AgreedFormat agreed_;
  std::optional<V4l2Stream> stream_;
  V4l2Exposure exposure_;
  std::atomic<bool> streaming_{false};
  CameraCounts counts_;

  std::int64_t retry_us_ = kFirstRetry_us, next_try_us_ = 0;
  CameraEvent::Kind said_ = CameraEvent::Kind::kStreaming;  // so that a failing search is told once
  std::int64_t last_frame_us_ = 0;                          // when the stream last gave anything
  std::int64_t last_utime_ = -1, sequence_ = -1;
  std::optional<std::uint32_t> last_driver_sequence_;

  std::mutex exposure_mutex_;  // capture only ever tries it
  std::atomic<bool> has_new_exposure_{false};
  ExposureOptions new_exposure_;
};

}  // namespace farpoint::drivers
