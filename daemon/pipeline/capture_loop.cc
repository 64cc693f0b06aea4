// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/capture_loop.h"

#include "daemon/system/stage_clock.h"

namespace farpoint::daemon {

CaptureLoop::CaptureLoop(CaptureSource* source, ImageQueue* images, CameraPresence* presence,
                         Notifier* arrived, double limit_s)
    : source_(*source), images_(*images), presence_(*presence), arrived_(*arrived), progress_(limit_s) {}

void CaptureLoop::run(const std::function<void()>& on_captured) {
  try {
    run_until_end(on_captured);
  } catch (...) {
    error_ = std::current_exception();
  }
  end();
}

void CaptureLoop::end() {
  images_.close();
  progress_.end();
  arrived_.notify();
}

void CaptureLoop::run_until_end(const std::function<void()>& on_captured) {
  while (!stop_.load(std::memory_order_relaxed)) {
    CapturedImage* image = images_.begin_push();
    const CaptureStatus status = source_.next(stop_, image);
    progress_.step();
    switch (status) {
      case CaptureStatus::kEnd:
        return;
      case CaptureStatus::kNothing:
      case CaptureStatus::kAway:
        if (presence_.note_nothing(status == CaptureStatus::kAway, image->in)) arrived_.notify();
        break;
      case CaptureStatus::kImage:
        hand_over();
        if (on_captured) on_captured();
        break;
    }
  }
}

void CaptureLoop::hand_over() {
  presence_.note_image(steady_s());
  images_.push();
  arrived_.notify();
}

}  // namespace farpoint::daemon
