// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/pipeline.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include "daemon/output/run_summary.h"
#include "daemon/system/logging.h"
#include "daemon/system/stop_signal.h"

namespace farpoint::daemon {
namespace {

// How often output looks for a frame that is being tracked: what it may add to the frame's age.
constexpr std::int64_t kLookEvery_us = 200;
// With a camera, output looks whether it has fallen silent and what has come from the bus.
constexpr std::int64_t kIdleLooksEvery_us = 20'000;
// Output wakes mapping; should output be held up by a disk, mapping looks for itself.
constexpr std::int64_t kMappingLooksEvery_us = 10'000;
constexpr std::int64_t kWatchEvery_us = 20'000;

}  // namespace

Pipeline::Pipeline(const Config& config, const PipelineOptions& options, CaptureSource* source,
                   Session* session, Outputs* outputs)
    : config_(config.realtime),
      options_(options),
      silence_period_s_(1.0 / config.lcm.status_rate_hz),
      source_(*source),
      session_(*session),
      outputs_(*outputs),
      images_(static_cast<std::size_t>(config.realtime.capture_queue), options.width_px, options.height_px),
      packages_(kPackages),
      notes_(kNotes),
      counts_of_absence_(4),
      features_(config.estimator.extractor.features, config.realtime.least_features) {
  constexpr double kMegabyte = 1e6;
  const std::size_t rings = kPackages * sizeof(FramePackage) + kNotes * sizeof(Note);
  spdlog::info("memory {:<32} {:>9.3f} MB", "captured images",
               static_cast<double>(images_.bytes()) / kMegabyte);
  spdlog::info("memory {:<32} {:>9.3f} MB", "rings of the output", static_cast<double>(rings) / kMegabyte);
  spdlog::info("memory {:<32} {:>9.3f} MB", "stacks of four threads",
               4.0 * config_.stack_kb * 1024 / kMegabyte);
}

void Pipeline::run(const ThreadHooks& hooks) {
  hooks_ = hooks;
  last_image_s_.store(steady_s(), std::memory_order_relaxed);
  {
    Thread mapping(kMappingThread, config_, config_.mapping, options_.realtime, [this] { map(); });
    Thread tracking(kTrackingThread, config_, config_.tracking, options_.realtime, [this] { track(); });
    tracking_thread_ = &tracking;
    Thread reporting(kOutputThread, config_, config_.output, options_.realtime, [this] { output(); });
    Thread capturing(kCaptureThread, config_, config_.capture, options_.realtime, [this] { capture(); });
    if (hooks_.on_started) hooks_.on_started();
    watch();
  }
  if (const std::int64_t lost = not_published_.load(); lost > 0)
    spdlog::warn("{} frames were tracked but not published: the output was behind", lost);
  if (const std::int64_t lost = not_noted_.load(); lost > 0)
    spdlog::warn("{} frames are missing in the summary: the main thread was behind", lost);
  if (capture_error_) std::rethrow_exception(capture_error_);
}

bool Pipeline::has_progressed() {
  const bool idle = !frames_in_work();
  const std::int64_t turns = turns_.load(std::memory_order_relaxed);
  const std::int64_t tracked = tracked_.load(std::memory_order_relaxed);
  const bool captures = turns != turns_seen_ || source_.is_opening();
  const bool progressed = captures && (tracked != tracked_seen_ || idle);
  turns_seen_ = turns;
  tracked_seen_ = tracked;
  return progressed;
}

// --- capture

void Pipeline::capture() {
  try {
    capture_until_end();
  } catch (...) {
    capture_error_ = std::current_exception();
  }
  images_.close();
  arrived_.notify();
}

void Pipeline::capture_until_end() {
  while (!stop_.load(std::memory_order_relaxed)) {
    CapturedImage* image = images_.begin_push();
    const CaptureStatus status = source_.next(stop_, image);
    turns_.fetch_add(1, std::memory_order_relaxed);
    if (status == CaptureStatus::kEnd) return;
    note_presence(status, image->in);
    if (status != CaptureStatus::kImage) continue;
    last_image_s_.store(steady_s(), std::memory_order_relaxed);
    images_.push();
    arrived_.notify();
    if (hooks_.on_captured) hooks_.on_captured();
  }
}

void Pipeline::note_presence(CaptureStatus status, const InputCounts& in) {
  const bool away = status == CaptureStatus::kAway;
  if (away) (void)counts_of_absence_.push(in);
  if (away == away_.load(std::memory_order_relaxed)) return;
  away_.store(away, std::memory_order_release);
  if (away) arrived_.notify();
}

// --- tracking

void Pipeline::track() {
  for (;;) {
    const std::uint32_t seen = arrived_.seen();
    if (CapturedImage* image = images_.pop()) {
      track_one(image);
    } else if (images_.is_closed()) {
      if (images_.waiting() == 0) break;
    } else {
      arrived_.wait(seen);
    }
  }
  tracking_ended_.store(true, std::memory_order_release);
  arrived_.notify();
  jobs_.notify();
}

void Pipeline::track_one(CapturedImage* image) {
  // No clock of the thread's CPU time here: that is a system call. Output reads it.
  const double began_s = steady_s();
  FramePackage* package = packages_.begin_push();
  const bool published = package != nullptr;
  if (!published) package = &unpublished_;
  package->chance = {};
  package->chance.capture_queue = static_cast<std::int32_t>(images_.waiting());
  package->chance.publish_queue = static_cast<std::int32_t>(packages_.size());
  package->chance.frames_dropped = image->frames_dropped;
  package->chance.features_asked = features_.features();
  const bool late = package->chance.capture_queue > 0 || image->frames_dropped > dropped_seen_;
  dropped_seen_ = image->frames_dropped;
  features_.note(late);
  const slam::ImageView view{image->image.data(), image->image.width_px, image->image.height_px,
                             image->image.width_px};
  package->result = session_.estimator().track(
      {image->meta.utime, image->meta.sequence, 0, view, package->chance.features_asked});
  package->counts = session_.estimator().counts();
  package->in = image->in;
  package->due_s = image->due_s;
  package->progress = image->progress;
  package->clock.new_frame();
  package->clock.set(timing_t::STAGE_DECODE, image->decode_cpu_ms, image->decode_wall_ms);
  images_.give_back(image);
  package->clock.set(timing_t::STAGE_TRACKING, -1.0, 1e3 * (steady_s() - began_s));
  if (hooks_.on_tracked) hooks_.on_tracked(package->result);
  if (published)
    packages_.end_push();
  else
    not_published_.fetch_add(1, std::memory_order_relaxed);
  tracked_.fetch_add(1, std::memory_order_release);
}

// --- mapping

void Pipeline::map() {
  for (;;) {
    const std::uint32_t seen = jobs_.seen();
    // Asked before looking, so that no job can come after the last look.
    const bool last = tracking_ended_.load(std::memory_order_acquire);
    if (session_.estimator().map()) continue;
    if (last) return;
    jobs_.wait(seen, kMappingLooksEvery_us);
  }
}

// --- output

bool Pipeline::frames_in_work() const {
  const std::int64_t tracked = tracked_.load(std::memory_order_acquire);
  return images_.pushed() > images_.dropped() + tracked;
}

// How long output may wait while no frame is in work.
std::int64_t Pipeline::idle_us() const {
  if (!is_live() && !outputs_.ticks()) return Notifier::kNoLimit;
  const double due_us = std::ceil(1e6 * (outputs_.next_due_s() - steady_s()));
  return static_cast<std::int64_t>(std::clamp(due_us, 0.0, static_cast<double>(kIdleLooksEvery_us)));
}

void Pipeline::output() {
  for (;;) {
    const std::uint32_t seen = arrived_.seen();
    const bool last = tracking_ended_.load(std::memory_order_acquire);
    const bool in_work = frames_in_work();
    // Whatever becomes of frames: the bus has a clock of its own.
    outputs_.tick(steady_s());
    if (FramePackage* package = packages_.front()) {
      if (package->result.job != 0) jobs_.notify();
      report_one(package);
      packages_.pop();
    } else if (last) {
      break;
    } else {
      report_silence_if_due();
      arrived_.wait(seen, in_work ? kLookEvery_us : idle_us());
    }
  }
  output_ended_.store(true, std::memory_order_release);
  ended_.notify();
}

void Pipeline::report_one(FramePackage* package) {
  // The last frames are reported after the thread has ended, and its clock with it.
  const double cpu_s = std::max(tracking_thread_->cpu_s(), tracking_cpu_s_);
  const double cpu_ms = 1e3 * (cpu_s - tracking_cpu_s_);
  tracking_cpu_s_ = cpu_s;
  const double wall_ms = package->clock.wall_ms(timing_t::STAGE_TRACKING);
  package->clock.set(timing_t::STAGE_TRACKING, cpu_ms, wall_ms);
  package->clock.set(timing_t::STAGE_FRAME, cpu_ms, wall_ms);
  package->chance.age_us = std::llround(1e6 * std::max(0.0, steady_s() - package->due_s));
  const FrameOutput& frame = session_.reporter().report(package, outputs_.counts());
  state_.store(frame.result.state, std::memory_order_relaxed);
  last_in_ = package->in;
  next_silence_s_ = 0.0;
  if (!notes_.push({frame.result, frame.valid, cpu_ms, package->progress}))
    not_noted_.fetch_add(1, std::memory_order_relaxed);
  if (hooks_.on_output) hooks_.on_output(frame);
}

void Pipeline::report_silence_if_due() {
  if (!is_live()) return;
  const double now_s = steady_s();
  // A frame that is being tracked will speak for itself.
  if (frames_in_work()) return;
  const bool away = away_.load(std::memory_order_acquire);
  while (const InputCounts* counts = counts_of_absence_.front()) {
    last_in_ = *counts;
    counts_of_absence_.pop();
  }
  const double silent_s = now_s - last_image_s_.load(std::memory_order_relaxed);
  if (!away && silent_s < options_.no_camera_after_s) return;
  if (now_s < next_silence_s_) return;
  next_silence_s_ = now_s + silence_period_s_;
  const auto utime = static_cast<std::int64_t>(std::llround(1e6 * now_s));
  const auto age_us = static_cast<std::int64_t>(std::llround(1e6 * silent_s));
  const FrameOutput& frame = session_.reporter().report_silence(utime, age_us, last_in_, outputs_.counts());
  state_.store(frame.result.state, std::memory_order_relaxed);
  if (hooks_.on_output) hooks_.on_output(frame);
}

// --- the calling thread

void Pipeline::watch() {
  Progress progress;
  for (;;) {
    const std::uint32_t seen = ended_.seen();
    const bool last = output_ended_.load(std::memory_order_acquire);
    take_notes(&progress);
    outputs_.write_logs();
    if (last) break;
    if (StopOnSignal::signal() != 0) stop_.store(true, std::memory_order_relaxed);
    if (hooks_.on_watch) hooks_.on_watch();
    ended_.wait(seen, kWatchEvery_us);
  }
  progress.clear();
}

void Pipeline::take_notes(Progress* progress) {
  while (const Note* note = notes_.front()) {
    session_.remember(note->published, note->valid, options_.remember);
    if (tracking_cpu_ms_.size() < kMaxCpuTimes) tracking_cpu_ms_.push_back(note->tracking_cpu_ms);
    show_progress(note->progress, note->published, frames_tracked(), progress);
    notes_.pop();
  }
}

}  // namespace farpoint::daemon
