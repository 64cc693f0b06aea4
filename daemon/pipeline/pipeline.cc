// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/pipeline.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "daemon/output/run_summary.h"
#include "daemon/system/core_plan.h"
#include "daemon/system/logging.h"
#include "daemon/system/stop_signal.h"

namespace farpoint::daemon {
namespace {

constexpr std::int64_t kWatchEvery_us = 20'000;
// The output waits for nothing longer than a scheduler's delay.
constexpr double kOutputBehind_s = 2.0;
// The calling thread answers commands and reads the configuration again.
constexpr double kNotesBehind_s = 30.0;

}  // namespace

std::size_t ring_slots(double seconds, double rate_hz) {
  constexpr double kUnknownRate_hz = 60.0, kLeast = 16.0, kMost = 65'536.0;
  const double slots = std::ceil(seconds * (rate_hz > 0.0 ? rate_hz : kUnknownRate_hz));
  return static_cast<std::size_t>(std::clamp(slots, kLeast, kMost));
}

Pipeline::Pipeline(const Config& config, const PipelineOptions& options, const PipelineParts& parts)
    : config_(resolved(config.realtime, usable_cores())),
      tally_(*parts.tally),
      realtime_(parts.realtime),
      images_(static_cast<std::size_t>(config.realtime.capture_queue), options.width_px, options.height_px,
              options.second_pixels),
      packages_(ring_slots(kOutputBehind_s, options.rate_hz)),
      notes_(ring_slots(kNotesBehind_s, options.rate_hz)),
      capture_(parts.source, &images_, &presence_, &arrived_, config.watchdog.capture_s),
      tracking_(parts.estimator, &images_, &packages_, &arrived_,
                {config.estimator.extractor.features, config.realtime.least_features},
                config.watchdog.tracking_s),
      mapping_(parts.estimator, &tracking_, config.watchdog.mapping_s),
      output_({&packages_, &tracking_, &mapping_, &arrived_, parts.reporter, parts.outputs, &notes_},
              {parts.reporter, &presence_, options.no_camera_after_s}, options.no_camera_after_s > 0.0,
              config.watchdog.output_s) {
  print_memory();
}

void Pipeline::print_memory() const {
  constexpr double kMegabyte = 1e6;
  const auto print = [](const char* what, double bytes) {
    spdlog::info("memory {:<32} {:>9.3f} MB", what, bytes / kMegabyte);
  };
  print("captured images", static_cast<double>(images_.bytes()));
  print("rings of the output",
        static_cast<double>(packages_.capacity() * sizeof(FramePackage) + notes_.bytes()));
  print("stacks of four threads", 4.0 * config_.stack_kb * 1024);
}

void Pipeline::run(const ThreadHooks& hooks) {
  presence_.begin(steady_s());
  run_threads(hooks);
  warn_of_losses();
  if (capture_.error()) std::rethrow_exception(capture_.error());
}

// Joined in the reverse order of their start.
struct Pipeline::Threads {
  std::optional<Thread> mapping, tracking, output, capture;
};

void Pipeline::run_threads(const ThreadHooks& hooks) {
  Threads threads;
  try {
    start(hooks, &threads);
    if (hooks.on_started) hooks.on_started();
    watch(hooks.on_watch);
  } catch (...) {
    give_up(threads);
    throw;
  }
}

void Pipeline::start(const ThreadHooks& hooks, Threads* threads) {
  threads->mapping.emplace(kMappingThread, config_, config_.mapping, realtime_,
                           [&] { mapping_.run(hooks.on_mapped); });
  threads->tracking.emplace(kTrackingThread, config_, config_.tracking, realtime_,
                            [&] { tracking_.run(hooks.on_tracked); });
  threads->output.emplace(kOutputThread, config_, config_.output, realtime_, [this, &hooks, threads] {
    output_.run([threads] { return threads->tracking->cpu_s(); }, hooks.on_output);
    output_ended_.store(true, std::memory_order_release);
    ended_.notify();
  });
  threads->capture.emplace(kCaptureThread, config_, config_.capture, realtime_,
                           [&] { capture_.run(hooks.on_captured); });
}

// The threads that run must end before they are joined: each ends after the one before it.
void Pipeline::give_up(const Threads& threads) {
  capture_.stop();
  if (!threads.capture) capture_.end();
  if (!threads.tracking) tracking_.end();
}

void Pipeline::warn_of_losses() const {
  if (const std::int64_t lost = tracking_.not_published(); lost > 0)
    spdlog::warn("{} frames were tracked but not published: the output was behind", lost);
  if (const std::int64_t lost = notes_.missing(); lost > 0)
    spdlog::warn("{} frames are missing in the summary: the main thread was behind", lost);
}

// --- the calling thread

const char* Pipeline::hung_thread(double now_s) {
  // All four are asked each time: a thread's limit counts from the last time it was asked.
  const std::array alive = {std::pair(kCaptureThread, capture_.is_alive(now_s)),
                            std::pair(kTrackingThread, tracking_.is_alive(now_s)),
                            std::pair(kMappingThread, mapping_.is_alive(now_s)),
                            std::pair(kOutputThread, output_.is_alive(now_s))};
  for (const auto& [name, is_alive] : alive)
    if (!is_alive) return name;
  return nullptr;
}

void Pipeline::watch(const std::function<void()>& on_watch) {
  Progress progress;
  for (;;) {
    const std::uint32_t seen = ended_.seen();
    const bool is_last = output_ended_.load(std::memory_order_acquire);
    take_notes(&progress);
    if (is_last) break;
    if (StopOnSignal::signal() != 0) capture_.stop();
    if (on_watch) on_watch();
    ended_.wait(seen, kWatchEvery_us);
  }
  progress.clear();
}

void Pipeline::take_notes(Progress* progress) {
  while (const FrameNote* note = notes_.front()) {
    tally_.note(note->published, note->valid, note->counts);
    if (tracking_cpu_ms_.size() < kMaxCpuTimes) tracking_cpu_ms_.push_back(note->tracking_cpu_ms);
    show_progress(note->progress, note->published, frames_tracked(), progress);
    notes_.pop();
  }
}

}  // namespace farpoint::daemon
