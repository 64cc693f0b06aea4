// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/camera_source.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "daemon/input/camera_counts.h"
#include "daemon/system/stage_clock.h"

namespace farpoint::daemon {
namespace {

constexpr int kTurn_ms = 100;

}  // namespace

CameraSource::CameraSource(int index, std::unique_ptr<drivers::Camera> camera)
    : index_(index), thread_name_("fp-capture-" + std::to_string(index)), camera_(std::move(camera)) {
  camera_->on_event([this](const drivers::CameraEvent& event) { note(event); });
}

void CameraSource::note(const drivers::CameraEvent& event) {
  events_.put(event);
  if (event.kind != drivers::CameraEvent::Kind::kStreaming) return;
  note_.format = event.format;
  note_.rate_hz = event.rate_hz;
}

bool CameraSource::grab(ipc::GreyImage* image, drivers::CameraFrame* frame) {
  const bool came = camera_->next(kTurn_ms, image, frame);
  troubles_.note(camera_->counts());
  Recorder* recorder = recorder_.load(std::memory_order_acquire);
  if (came && recorder != nullptr) recorder->offer(index_, *image, *frame);
  return came;
}

CaptureStatus CameraSource::next(const std::atomic<bool>& /*stop*/, CapturedImage* image) {
  const bool came = grab(&image->image, &image->meta);
  image->in = input_counts(camera_->counts());
  if (const Recorder* recorder = recorder_.load(std::memory_order_acquire))
    image->in.not_recorded = recorder->left_out();
  for (StereoWatch& pair : pairs_) {
    pair.note(came ? std::optional(image->meta) : std::nullopt, std::llround(1e6 * steady_s()));
    pair.add_to(&image->in);
  }
  if (came) {
    note_.exposure_us = image->meta.exposure_us;
    note_.gain = image->meta.gain;
  }
  image->camera = note_;
  image->progress = -1.0;
  if (!came) return camera_->is_streaming() ? CaptureStatus::kNothing : CaptureStatus::kAway;
  // Both are CLOCK_MONOTONIC: the age of what is published counts from mid-exposure.
  image->due_s = 1e-6 * static_cast<double>(image->meta.utime);
  image->decode_cpu_ms = image->decode_wall_ms = -1.0;
  return CaptureStatus::kImage;
}

// Of the running opening; 0 while none runs.
double CameraSource::opening_s(double now_s) const {
  const std::int64_t since_us = camera_->opening_since_us();
  if (since_us == drivers::Camera::kNotOpening) return 0.0;
  return std::max(now_s - 1e-6 * static_cast<double>(since_us), 1e-6);
}

bool CameraSource::is_opening() const {
  const double opening_s = this->opening_s(steady_s());
  return opening_s > 0.0 && opening_s < open_limit_s_;
}

std::string CameraSource::take_troubles(double now_s) {
  constexpr double kSlow_s = 2.0;
  const bool slow = opening_s(now_s) > kSlow_s;
  if (slow && !std::exchange(said_opening_, true))
    return "opening or closing it has taken " + std::to_string(std::lround(opening_s(now_s))) + " s so far";
  if (!slow) said_opening_ = false;
  return troubles_.take_line(now_s);
}

void CameraSource::run() {
  while (!stop_.load(std::memory_order_relaxed)) turn();
}

void CameraSource::turn() {
  drivers::CameraFrame frame;
  const bool came = grab(&image_, &frame);
  reports_.put(came ? std::optional(frame) : std::nullopt, camera_->is_streaming(), camera_->counts());
}

}  // namespace farpoint::daemon
