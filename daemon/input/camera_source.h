// SPDX-License-Identifier: Apache-2.0
// The capture loop of one live camera: next image, events, recording, counts. The first camera feeds the
// pipeline. Each further one has a thread of its own; the first one's thread matches its images by time with
// its own. Neither thread waits for the other.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "daemon/input/camera_events.h"
#include "daemon/input/camera_note.h"
#include "daemon/input/camera_reports.h"
#include "daemon/input/camera_troubles.h"
#include "daemon/input/capture_source.h"
#include "daemon/input/recorder.h"
#include "daemon/input/stereo_watch.h"
#include "drivers/camera/camera.h"

namespace farpoint::daemon {

class CameraSource final : public CaptureSource {
 public:
  // index: of the calibration's cameras; 0 is the first.
  CameraSource(int index, std::unique_ptr<drivers::Camera> camera);
  // One other thread, once, at any time. The recorder outlives this object.
  void record_to(Recorder* recorder) { recorder_.store(recorder, std::memory_order_release); }

  // First camera, before the first image: pairs its images with those of `further`, which outlives this
  // object.
  void pair_with(CameraSource* further, std::int64_t tolerance_us) {
    pairs_.emplace_back(&further->reports_, tolerance_us);
  }
  // Call before the first image. Longest time of one opening or closing; the default is without limit.
  void limit_opening(double limit_s) { open_limit_s_ = limit_s; }
  // First camera: an image goes on at once, whether its partners have arrived or not.
  [[nodiscard]] CaptureStatus next(const std::atomic<bool>& stop, CapturedImage* image) override;

  [[nodiscard]] bool is_opening() const override;

  // Further camera's thread: runs until stop(), which takes effect within 0.1 s. Waits for the camera only.
  void run();
  // One turn of run(), for tests without a thread.
  void turn();
  // Any thread.
  void stop() { stop_.store(true, std::memory_order_relaxed); }
  // Name of that thread: fp-capture-N with the camera's index.
  [[nodiscard]] const std::string& thread_name() const { return thread_name_; }

  [[nodiscard]] int index() const { return index_; }
  // One other thread: takes the oldest new event; false without one.
  [[nodiscard]] bool take_event(drivers::CameraEvent* event) { return events_.take(event); }
  // One other thread: a line for the log about a slow opening, and images that were refused or whose time is
  // doubtful; mostly empty.
  [[nodiscard]] std::string take_troubles(double now_s);
  // Any thread.
  void set_exposure(const drivers::ExposureOptions& options) { camera_->set_exposure(options); }

 private:
  void note(const drivers::CameraEvent& event);
  [[nodiscard]] double opening_s(double now_s) const;
  [[nodiscard]] bool grab(ipc::GreyImage* image, drivers::CameraFrame* frame);

  const int index_;
  const std::string thread_name_;
  CameraEvents events_;
  CameraNote note_;  // capture thread
  CameraTroubles troubles_;
  std::unique_ptr<drivers::Camera> camera_;
  std::atomic<Recorder*> recorder_{nullptr};
  double open_limit_s_ = std::numeric_limits<double>::infinity();
  bool said_opening_ = false;
  std::vector<StereoWatch> pairs_;  // first camera: one a further camera
  // Further camera.
  CameraReports reports_;
  ipc::GreyImage image_;
  std::atomic<bool> stop_{false};
};

}  // namespace farpoint::daemon
