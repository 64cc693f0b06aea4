#include "daemon/camera_source.h"

#include "daemon/stage_clock.h"

namespace farpoint::daemon {
namespace {

constexpr int kTurn_ms = 100;

InputCounts input_counts(const drivers::CameraCounts& c) {
  InputCounts in;
  in.images = c.frames + c.flagged + c.undecodable + c.times_backwards;
  in.undecodable = c.undecodable;
  in.times_backwards = c.times_backwards;
  in.missing = c.missing;
  in.flagged = c.flagged;
  in.camera_losses = c.lost + c.stalled;
  return in;
}

}  // namespace

CameraSource::CameraSource(std::unique_ptr<drivers::Camera> camera) : camera_(std::move(camera)) {
  camera_->on_event([this](const drivers::CameraEvent& event) { (void)events_.push(event); });
}

CaptureStatus CameraSource::next(const std::atomic<bool>& /*stop*/, CapturedImage* image) {
  drivers::CameraFrame frame;
  const bool came = camera_->next(kTurn_ms, &image->image, &frame);
  image->in = input_counts(camera_->counts());
  image->progress = -1.0;
  if (!came) return camera_->is_streaming() ? CaptureStatus::kNothing : CaptureStatus::kAway;
  image->utime = frame.utime;
  image->sequence = frame.sequence;
  image->exposure_us = frame.exposure_us;
  image->gain = frame.gain;
  // Both are CLOCK_MONOTONIC: the age of what is published counts from mid-exposure.
  image->due_s = 1e-6 * static_cast<double>(frame.utime);
  image->decode_cpu_ms = image->decode_wall_ms = -1.0;
  if (recorder_ != nullptr) recorder_->offer(*image);
  return CaptureStatus::kImage;
}

bool CameraSource::take_event(drivers::CameraEvent* event) {
  const drivers::CameraEvent* oldest = events_.front();
  if (oldest == nullptr) return false;
  *event = *oldest;
  events_.pop();
  return true;
}

}  // namespace farpoint::daemon
