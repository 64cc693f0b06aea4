// SPDX-License-Identifier: Apache-2.0
// The capture thread: images from a source into the queue.
#pragma once

#include <atomic>
#include <exception>
#include <functional>

#include "daemon/input/capture_source.h"
#include "daemon/input/image_queue.h"
#include "daemon/pipeline/camera_presence.h"
#include "daemon/pipeline/thread_progress.h"
#include "daemon/system/notifier.h"

namespace farpoint::daemon {

class CaptureLoop {
 public:
  // All must outlive this object. `arrived` is notified after each image, when the camera goes away, and at
  // the end. limit_s: see ThreadProgress.
  CaptureLoop(CaptureSource* source, ImageQueue* images, CameraPresence* presence, Notifier* arrived,
              double limit_s);

  // The thread: to the end of the source or stop(), then closes the queue. Waits in the source's next().
  void run(const std::function<void()>& on_captured);

  // No image follows: the end of run(), or in its place where the thread does not run.
  void end();

  // Any thread. Takes effect within 0.1 s.
  void stop() { stop_.store(true, std::memory_order_relaxed); }
  // One other thread. Capture always has work, as the source waits 0.1 s at most, except while a camera
  // opens.
  [[nodiscard]] bool is_alive(double now_s) { return progress_.is_alive(now_s, !source_.is_opening()); }
  // What reading threw, null otherwise. After the end of the thread.
  [[nodiscard]] const std::exception_ptr& error() const { return error_; }

 private:
  void run_until_end(const std::function<void()>& on_captured);
  void hand_over();

  CaptureSource& source_;
  ImageQueue& images_;
  CameraPresence& presence_;
  Notifier& arrived_;
  ThreadProgress progress_;
  std::atomic<bool> stop_{false};
  std::exception_ptr error_;
};

}  // namespace farpoint::daemon
