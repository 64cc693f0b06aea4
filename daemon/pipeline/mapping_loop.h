// SPDX-License-Identifier: Apache-2.0
// The mapping thread: one job after the other.
#pragma once

#include <functional>

#include "daemon/pipeline/mapping_times.h"
#include "daemon/pipeline/thread_progress.h"
#include "daemon/pipeline/tracking_loop.h"
#include "daemon/system/notifier.h"
#include "slam/estimator.h"

namespace farpoint::daemon {

class MappingLoop {
 public:
  // Both must outlive this object. limit_s: see ThreadProgress.
  MappingLoop(slam::Estimator* estimator, const TrackingLoop* tracking, double limit_s);
  ~MappingLoop() { estimator_.listen(nullptr); }
  MappingLoop(const MappingLoop&) = delete;
  MappingLoop& operator=(const MappingLoop&) = delete;

  // The thread: until tracking has ended and no job waits. on_mapped: called after each reply.
  void run(const std::function<void()>& on_mapped);

  // Output's thread: adds the times of the keyframes that are done since the last call.
  void add_times_to(StageClock* clock) { times_.add_to(clock); }

  // Any thread: a job was sent. Without this call mapping looks every 10 ms.
  void wake() { jobs_.notify(); }
  // One other thread. The thread turns while it waits for jobs too.
  [[nodiscard]] bool is_alive(double now_s) { return progress_.is_alive(now_s, true); }

 private:
  slam::Estimator& estimator_;
  const TrackingLoop& tracking_;
  Notifier jobs_;
  ThreadProgress progress_;
  MappingTimes times_;
};

}  // namespace farpoint::daemon
