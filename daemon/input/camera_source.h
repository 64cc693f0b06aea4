// A live camera as the capture thread's source, with a recorder beside it where one is wanted, and a second
// camera where there is one.
#pragma once

#include <memory>
#include <optional>

#include "daemon/input/camera_events.h"
#include "daemon/input/capture_source.h"
#include "daemon/input/recorder.h"
#include "daemon/input/stereo_watch.h"
#include "drivers/camera/camera.h"

namespace farpoint::daemon {

class CameraSource final : public CaptureSource {
 public:
  explicit CameraSource(std::unique_ptr<drivers::Camera> camera);
  // Before the first image; the recorder outlives this.
  void record_to(Recorder* recorder) { recorder_ = recorder; }
  // Before the first image; the other camera outlives this. Images go on at once, with it or without.
  void pair_with(SecondCamera* second, std::int64_t tolerance_us) { stereo_.emplace(second, tolerance_us); }

  [[nodiscard]] CaptureStatus next(const std::atomic<bool>& stop, CapturedImage* image) override;

  // Any one other thread: what has happened since, oldest first; false where nothing has.
  [[nodiscard]] bool take_event(drivers::CameraEvent* event) { return events_.take(event); }
  void set_exposure(const drivers::ExposureOptions& options) { camera_->set_exposure(options); }

 private:
  static constexpr int kIndex = 0;  // of the calibration's cameras

  CameraEvents events_;
  std::unique_ptr<drivers::Camera> camera_;
  Recorder* recorder_ = nullptr;
  std::optional<StereoWatch> stereo_;
};

}  // namespace farpoint::daemon
