#include "daemon/threaded_replay.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <ctime>

#include "daemon/last_line.h"
#include "daemon/logging.h"
#include "daemon/stop_signal.h"

namespace farpoint::daemon {
namespace {

// How often output looks for a frame that is being tracked: what it may add to the frame's age.
constexpr std::int64_t kLookEvery_us = 200;
// Output wakes mapping; should output be held up by a disk, mapping looks for itself.
constexpr std::int64_t kMappingLooksEvery_us = 10'000;
constexpr std::int64_t kWatchEvery_us = 20'000;

// Capture's one waiting place. In slices, so that a signal ends a replay within a long gap too.
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

ThreadedReplay::ThreadedReplay(const Config& config, double speed, LogFrameSource* source, Session* session,
                               Outputs* outputs)
    : config_(config.realtime),
      speed_(speed),
      source_(*source),
      session_(*session),
      outputs_(*outputs),
      images_(static_cast<std::size_t>(config.realtime.capture_queue), source->image().width_px,
              source->image().height_px),
      packages_(kPackages),
      notes_(kNotes) {
  constexpr double kMegabyte = 1e6;
  const std::size_t rings = kPackages * sizeof(FramePackage) + kNotes * sizeof(Note);
  spdlog::info("memory {:<32} {:>9.3f} MB", "captured images", double(images_.bytes()) / kMegabyte);
  spdlog::info("memory {:<32} {:>9.3f} MB", "rings of the output", double(rings) / kMegabyte);
  spdlog::info("memory {:<32} {:>9.3f} MB", "stacks of four threads",
               4.0 * config_.stack_kb * 1024 / kMegabyte);
}

void ThreadedReplay::run(const SourceFrame& first, const ThreadHooks& hooks) {
  hooks_ = hooks;
  lock_memory(config_);
  // Capture must not be kept from its clock by tracking, nor tracking by output.
  const int priority = config_.tracking_priority;
  const int above = priority > 0 ? priority + 1 : 0, below = priority > 1 ? priority - 1 : 0;
  {
    Thread mapping(kMappingThread, config_, 0, [this] { map(); });
    Thread tracking(kTrackingThread, config_, priority, [this] { track(); });
    tracking_thread_ = &tracking;
    Thread reporting(kOutputThread, config_, below, [this] { output(); });
    Thread capturing(kCaptureThread, config_, above, [this, &first] { capture(first); });
    watch();
  }
  if (const std::int64_t lost = not_published_.load(); lost > 0)
    spdlog::warn("{} frames were tracked but not published: the output was behind", lost);
  if (const std::int64_t lost = not_noted_.load(); lost > 0)
    spdlog::warn("{} frames are missing in the summary: the main thread was behind", lost);
  StopOnSignal::check();
  if (capture_error_) std::rethrow_exception(capture_error_);
}

// --- capture

void ThreadedReplay::capture(const SourceFrame& first) {
  try {
    SourceFrame frame = first;
    StageClock clock;
    const double start_s = steady_s();
    do {
      CapturedImage* image = images_.begin_push();
      source_.swap_image(&image->image);
      image->utime = frame.utime;
      image->sequence = frame.sequence;
      image->in = source_.counts();
      image->progress = source_.progress();
      image->decode_cpu_ms = clock.cpu_ms(timing_t::STAGE_DECODE);
      image->decode_wall_ms = clock.wall_ms(timing_t::STAGE_DECODE);
      image->due_s = start_s + 1e-6 * static_cast<double>(frame.utime - first.utime) / speed_;
      sleep_until(image->due_s, stop_);
      if (stop_.load(std::memory_order_relaxed)) break;
      images_.push();
      arrived_.notify();
      if (hooks_.on_captured) hooks_.on_captured();
      clock.new_frame();
    } while (source_.next(&frame, &clock));
  } catch (...) {
    capture_error_ = std::current_exception();
  }
  images_.close();
  arrived_.notify();
}

// --- tracking

void ThreadedReplay::track() {
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

void ThreadedReplay::track_one(CapturedImage* image) {
  // No clock of the thread's CPU time here: that is a system call. Output reads it.
  const double began_s = steady_s();
  FramePackage* package = packages_.begin_push();
  const bool published = package != nullptr;
  if (!published) package = &unpublished_;
  package->chance = {};
  package->chance.capture_queue = static_cast<std::int32_t>(images_.waiting());
  package->chance.publish_queue = static_cast<std::int32_t>(packages_.size());
  package->chance.frames_dropped = image->frames_dropped;
  const slam::ImageView view{image->image.data(), image->image.width_px, image->image.height_px,
                             image->image.width_px};
  package->result = session_.estimator().track({image->utime, image->sequence, 0, view});
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

void ThreadedReplay::map() {
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

bool ThreadedReplay::frames_in_work() const {
  const std::int64_t tracked = tracked_.load(std::memory_order_acquire);
  return images_.pushed() > images_.dropped() + tracked;
}

void ThreadedReplay::output() {
  for (;;) {
    const std::uint32_t seen = arrived_.seen();
    const bool last = tracking_ended_.load(std::memory_order_acquire);
    const bool in_work = frames_in_work();
    if (FramePackage* package = packages_.front()) {
      if (package->result.job != 0) jobs_.notify();
      report_one(package);
      packages_.pop();
    } else if (last) {
      break;
    } else {
      arrived_.wait(seen, in_work ? kLookEvery_us : Notifier::kNoLimit);
    }
  }
  output_ended_.store(true, std::memory_order_release);
  ended_.notify();
}

void ThreadedReplay::report_one(FramePackage* package) {
  // The last frames are reported after the thread has ended, and its clock with it.
  const double cpu_s = std::max(tracking_thread_->cpu_s(), tracking_cpu_s_);
  const double cpu_ms = 1e3 * (cpu_s - tracking_cpu_s_);
  tracking_cpu_s_ = cpu_s;
  const double wall_ms = package->clock.wall_ms(timing_t::STAGE_TRACKING);
  package->clock.set(timing_t::STAGE_TRACKING, cpu_ms, wall_ms);
  package->clock.set(timing_t::STAGE_FRAME, cpu_ms, wall_ms);
  package->chance.age_us = std::llround(1e6 * std::max(0.0, steady_s() - package->due_s));
  const FrameOutput& frame = session_.reporter().report(package, outputs_.counts());
  if (!notes_.push({frame.result, frame.valid, cpu_ms, package->progress}))
    not_noted_.fetch_add(1, std::memory_order_relaxed);
  if (hooks_.on_output) hooks_.on_output(frame);
}

// --- the calling thread

void ThreadedReplay::watch() {
  Progress progress;
  for (;;) {
    const std::uint32_t seen = ended_.seen();
    const bool last = output_ended_.load(std::memory_order_acquire);
    take_notes(&progress);
    if (last) break;
    if (StopOnSignal::signal() != 0) stop_.store(true, std::memory_order_relaxed);
    ended_.wait(seen, kWatchEvery_us);
  }
  progress.clear();
}

void ThreadedReplay::take_notes(Progress* progress) {
  while (const Note* note = notes_.front()) {
    session_.remember(note->published, note->valid);
    tracking_cpu_ms_.push_back(note->tracking_cpu_ms);
    show_progress(note->progress, note->published, static_cast<std::int64_t>(tracking_cpu_ms_.size()),
                  progress);
    notes_.pop();
  }
}

}  // namespace farpoint::daemon
