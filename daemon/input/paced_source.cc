// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/paced_source.h"

#include <algorithm>
#include <cmath>
#include <ctime>

namespace farpoint::daemon {
namespace {

// In slices, so that a signal ends a replay within a long gap too.
void sleep_until(double due_s, const std::atomic<bool>& stop) {
  constexpr double kSlice_s = 0.1;
  for (double now_s = steady_s(); now_s < due_s && !stop.load(std::memory_order_relaxed);
       now_s = steady_s()) {
    const double wake_s = std::min(due_s, now_s + kSlice_s);
    timespec wake{};
    wake.tv_sec = static_cast<time_t>(std::floor(wake_s));
    wake.tv_nsec = static_cast<long>((wake_s - std::floor(wake_s)) * 1e9);
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, nullptr);
  }
}

}  // namespace

CaptureStatus PacedSource::next(const std::atomic<bool>& stop, CapturedImage* image) {
  clock_.new_frame();
  if (started_ && !source_.next(&frame_, &clock_)) return CaptureStatus::kEnd;
  if (!started_) start_s_ = steady_s();
  started_ = true;
  source_.swap_image(&image->image);
  image->has_second = frame_.second != nullptr;
  if (image->has_second) source_.swap_second(&image->second);
  image->meta = frame_.meta;
  image->in = source_.counts();
  image->progress = source_.progress();
  image->decode_cpu_ms = clock_.cpu_ms(timing_t::STAGE_DECODE);
  image->decode_wall_ms = clock_.wall_ms(timing_t::STAGE_DECODE);
  image->due_s = start_s_ + 1e-6 * static_cast<double>(frame_.meta.utime - first_utime_) / speed_;
  sleep_until(image->due_s, stop);
  return stop.load(std::memory_order_relaxed) ? CaptureStatus::kEnd : CaptureStatus::kImage;
}

}  // namespace farpoint::daemon
