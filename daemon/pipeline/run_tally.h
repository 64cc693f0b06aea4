// SPDX-License-Identifier: Apache-2.0
// What the end of a run is summarised from, kept frame by frame.
#pragma once

#include "daemon/output/messages.h"

namespace farpoint::daemon {

class RunTally {
 public:
  // keep_times: the times of valid frames are kept too; they grow with the run.
  explicit RunTally(bool keep_times) : keep_times_(keep_times) {}

  // Each published frame, in order. counts: the estimator's, as of this frame.
  void note(const slam::FrameResult& published, bool valid, const slam::EstimatorCounts& counts);

  [[nodiscard]] const RunEnd& end() const { return end_; }
  // For results that are known after the last frame.
  [[nodiscard]] RunEnd* mutable_end() { return &end_; }

 private:
  const bool keep_times_;
  RunEnd end_;
};

}  // namespace farpoint::daemon
