// SPDX-License-Identifier: Apache-2.0
// The output thread: reports tracked frames and silence, and drives the bus's clock. Writes no file: see
// FileWriter.
#pragma once

#include <atomic>
#include <functional>

#include "daemon/output/frame_reporter.h"
#include "daemon/output/outputs.h"
#include "daemon/pipeline/frame_notes.h"
#include "daemon/pipeline/mapping_loop.h"
#include "daemon/pipeline/silence_reporter.h"
#include "daemon/pipeline/thread_progress.h"
#include "daemon/pipeline/tracking_loop.h"
#include "daemon/system/notifier.h"

namespace farpoint::daemon {

class OutputLoop {
 public:
  using Hook = std::function<void(const FrameOutput&)>;
  // What the thread reads, where it reports, and whom it wakes. All outlive the loop.
  struct Ends {
    PackageRing* packages = nullptr;
    const TrackingLoop* tracking = nullptr;
    MappingLoop* mapping = nullptr;
    Notifier* arrived = nullptr;  // the thread waits here; capture and tracking notify it
    FrameReporter* reporter = nullptr;
    Outputs* outputs = nullptr;
    FrameNotes* notes = nullptr;
  };

  // is_live: the thread looks for silence while no frame comes. limit_s: see ThreadProgress.
  OutputLoop(const Ends& ends, const SilenceReporter& silence, bool is_live, double limit_s);

  // The thread: until tracking has ended and its last frame is reported. tracking_cpu_s: CPU time of the
  // tracking thread so far.
  void run(const std::function<double()>& tracking_cpu_s, const Hook& on_output);

  // Any thread: as published last.
  [[nodiscard]] slam::State state() const { return state_.load(std::memory_order_relaxed); }
  // One other thread. A live thread turns every 20 ms.
  [[nodiscard]] bool is_alive(double now_s) { return progress_.is_alive(now_s, true); }
  // After the end of the thread: the newest counts of the input.
  [[nodiscard]] const InputCounts& input() const { return silence_.input(); }

 private:
  void report(FramePackage* package, double tracking_cpu_s, const Hook& on_output);
  void report_silence(const Hook& on_output);
  [[nodiscard]] std::int64_t longest_wait_us(bool frame_in_work) const;

  const Ends ends_;
  SilenceReporter silence_;
  const bool is_live_;
  ThreadProgress progress_;
  double tracking_cpu_s_ = 0;  // when the last frame was reported
  std::atomic<slam::State> state_{slam::State::kStarting};
};

}  // namespace farpoint::daemon
