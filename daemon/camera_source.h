// A live camera as the capture thread's source, with a recorder beside it where one is wanted.
#pragma once

#include <memory>

#include "daemon/capture_source.h"
#include "daemon/recorder.h"
#include "drivers/camera.h"
#include "slam/spsc_ring.h"

namespace farpoint::daemon {

class CameraSource final : public CaptureSource {
 public:
  explicit CameraSource(std::unique_ptr<drivers::Camera> camera);
  // Before the first image; the recorder outlives this.
  void record_to(Recorder* recorder) { recorder_ = recorder; }

  [[nodiscard]] CaptureStatus next(const std::atomic<bool>& stop, CapturedImage* image) override;

  // Any one other thread: what has happened since, oldest first; false where nothing has.
  [[nodiscard]] bool take_event(drivers::CameraEvent* event);
  void set_exposure(const drivers::ExposureOptions& options) { camera_->set_exposure(options); }

 private:
  static constexpr std::size_t kEvents = 64;  // older ones are what an operator wants: newer give way

  std::unique_ptr<drivers::Camera> camera_;
  Recorder* recorder_ = nullptr;
  slam::SpscRing<drivers::CameraEvent> events_{kEvents};
};

}  // namespace farpoint::daemon
