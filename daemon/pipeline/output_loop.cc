// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/output_loop.h"

#include <algorithm>
#include <cmath>

namespace farpoint::daemon {
namespace {

// While a frame is being tracked: adds at most this to the frame's age.
constexpr std::int64_t kLookEvery_us = 200;
// While none is: for silence, and for what comes from the bus.
constexpr std::int64_t kIdleLookEvery_us = 20'000;

}  // namespace

OutputLoop::OutputLoop(const Ends& ends, const SilenceReporter& silence, bool is_live, double limit_s)
    : ends_(ends), silence_(silence), is_live_(is_live), progress_(limit_s) {}

void OutputLoop::run(const std::function<double()>& tracking_cpu_s, const Hook& on_output) {
  for (;;) {
    const std::uint32_t seen = ends_.arrived->seen();
    // Read before looking for a package: none can come after the last look.
    const bool is_last = ends_.tracking->has_ended();
    const bool frame_in_work = ends_.tracking->has_work();
    // The bus has a clock of its own, independent of frames.
    ends_.outputs->tick(steady_s());
    progress_.step();
    if (FramePackage* package = ends_.packages->front()) {
      report(package, tracking_cpu_s(), on_output);
      ends_.packages->pop();
      continue;
    }
    if (is_last) break;
    // A frame in work is reported soon.
    if (!ends_.tracking->has_work()) report_silence(on_output);
    ends_.arrived->wait(seen, longest_wait_us(frame_in_work));
  }
  progress_.end();
}

std::int64_t OutputLoop::longest_wait_us(bool frame_in_work) const {
  if (frame_in_work) return kLookEvery_us;
  if (!is_live_ && !ends_.outputs->ticks()) return Notifier::kNoLimit;
  const double due_us = std::ceil(1e6 * (ends_.outputs->next_due_s() - steady_s()));
  return static_cast<std::int64_t>(std::clamp(due_us, 0.0, static_cast<double>(kIdleLookEvery_us)));
}

void OutputLoop::report(FramePackage* package, double tracking_cpu_s, const Hook& on_output) {
  if (package->result.job != 0) ends_.mapping->wake();
  // The last frames are reported after the tracking thread has ended, and its clock with it.
  const double cpu_s = std::max(tracking_cpu_s, tracking_cpu_s_);
  const double cpu_ms = 1e3 * (cpu_s - tracking_cpu_s_);
  tracking_cpu_s_ = cpu_s;
  const double wall_ms = package->clock.wall_ms(timing_t::STAGE_TRACKING);
  package->clock.set(timing_t::STAGE_TRACKING, cpu_ms, wall_ms);
  package->clock.set(timing_t::STAGE_FRAME, cpu_ms, wall_ms);
  ends_.mapping->add_times_to(&package->clock);
  package->chance.age_us = std::llround(1e6 * std::max(0.0, steady_s() - package->due_s));
  const FrameOutput& frame = ends_.reporter->report(package, ends_.outputs->counts());
  state_.store(frame.result.state, std::memory_order_relaxed);
  silence_.note_frame(package->in);
  ends_.notes->push({frame.result, frame.valid, package->counts, cpu_ms, package->progress});
  if (on_output) on_output(frame);
}

void OutputLoop::report_silence(const Hook& on_output) {
  const FrameOutput* frame = silence_.report_if_due(steady_s(), ends_.outputs->counts());
  if (frame == nullptr) return;
  state_.store(frame->result.state, std::memory_order_relaxed);
  if (on_output) on_output(*frame);
}

}  // namespace farpoint::daemon
