// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/camera_source.h"

#include <cmath>

#include "daemon/input/camera_counts.h"
#include "daemon/system/stage_clock.h"

namespace farpoint::daemon {
namespace {

constexpr int kTurn_ms = 100;

}  // namespace

CameraSource::CameraSource(std::unique_ptr<drivers::Camera> camera) : camera_(std::move(camera)) {
  events_.listen_to(camera_.get());
}

CaptureStatus CameraSource::next(const std::atomic<bool>& /*stop*/, CapturedImage* image) {
  drivers::CameraFrame frame;
  const bool came = camera_->next(kTurn_ms, &image->image, &frame);
  image->in = input_counts(camera_->counts());
  if (stereo_) {
    stereo_->note(came ? std::optional(frame.utime) : std::nullopt, std::llround(1e6 * steady_s()));
    stereo_->add_to(&image->in);
  }
  image->progress = -1.0;
  if (!came) return camera_->is_streaming() ? CaptureStatus::kNothing : CaptureStatus::kAway;
  image->utime = frame.utime;
  image->sequence = frame.sequence;
  image->exposure_us = frame.exposure_us;
  image->gain = frame.gain;
  // Both are CLOCK_MONOTONIC: the age of what is published counts from mid-exposure.
  image->due_s = 1e-6 * static_cast<double>(frame.utime);
  image->decode_cpu_ms = image->decode_wall_ms = -1.0;
  if (Recorder* recorder = recorder_.load(std::memory_order_acquire))
    recorder->offer(kIndex, image->image, frame);
  return CaptureStatus::kImage;
}

}  // namespace farpoint::daemon
