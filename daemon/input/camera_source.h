// SPDX-License-Identifier: Apache-2.0
// A live camera as the capture thread's source, with an optional recorder and second camera.
#pragma once

#include <atomic>
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
  // One other thread, once. The recorder outlives this object.
  void record_to(Recorder* recorder) { recorder_.store(recorder, std::memory_order_release); }
  // Call before the first image. The other camera outlives this object. Images never wait for it.
  void pair_with(SecondCamera* second, std::int64_t tolerance_us) { stereo_.emplace(second, tolerance_us); }

  [[nodiscard]] CaptureStatus next(const std::atomic<bool>& stop, CapturedImage* image) override;

  // One other thread: takes the oldest new event; false without one.
  [[nodiscard]] bool take_event(drivers::CameraEvent* event) { return events_.take(event); }
  void set_exposure(const drivers::ExposureOptions& options) { camera_->set_exposure(options); }

 private:
  static constexpr int kIndex = 0;  // of the calibration's cameras

  CameraEvents events_;
  std::unique_ptr<drivers::Camera> camera_;
  std::atomic<Recorder*> recorder_{nullptr};
  std::optional<StereoWatch> stereo_;
};

}  // namespace farpoint::daemon
