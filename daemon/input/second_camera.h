// SPDX-License-Identifier: Apache-2.0
// The second camera of a stereo pair, on a capture thread of its own (fp-capture-1). Its images go to the
// recorder; the first camera's thread receives their times. Neither thread waits for the other.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

#include "daemon/input/camera_events.h"
#include "daemon/input/recorder.h"
#include "drivers/camera/camera.h"
#include "slam/spsc_ring.h"

namespace farpoint::daemon {

class SecondCamera {
 public:
  static constexpr const char* kThread = "fp-capture-1";
  static constexpr int kIndex = 1;  // of the calibration's cameras; the first is 0

  // An image, a change of the camera's presence, or the number of unreported images.
  struct News {
    bool has_image = false;
    std::int64_t utime = 0;  // of the image
    bool is_streaming = false;
    drivers::CameraCounts counts;
    std::int64_t untold = 0;  // images not reported so far, since the ring was full
  };

  explicit SecondCamera(std::unique_ptr<drivers::Camera> camera);
  // One other thread, once. The recorder outlives this object.
  void record_to(Recorder* recorder) { recorder_.store(recorder, std::memory_order_release); }

  // Its thread: runs until stop(), which takes effect within 0.1 s. Waits for the camera only.
  void run();
  // One turn of run(), for tests without a thread.
  void turn();

  // Any thread.
  void stop() { stop_.store(true, std::memory_order_relaxed); }
  void set_exposure(const drivers::ExposureOptions& options) { camera_->set_exposure(options); }
  // One other thread.
  [[nodiscard]] bool take_event(drivers::CameraEvent* event) { return events_.take(event); }
  // The first camera's capture thread: takes the oldest new entry; false without one.
  [[nodiscard]] bool take_news(News* news);

 private:
  // The first camera's thread reads at least every 0.1 s: enough for 600 images a second.
  static constexpr std::size_t kNews = 64;
  void tell(const drivers::CameraFrame* frame);

  CameraEvents events_;
  std::unique_ptr<drivers::Camera> camera_;
  std::atomic<Recorder*> recorder_{nullptr};
  ipc::GreyImage image_;
  bool told_streaming_ = false;
  std::int64_t untold_ = 0, told_untold_ = 0;
  slam::SpscRing<News> news_{kNews};
  std::atomic<bool> stop_{false};
};

}  // namespace farpoint::daemon
