// SPDX-License-Identifier: Apache-2.0
// Plays a recorded log at a multiple of its pace.
#pragma once

#include "daemon/input/capture_source.h"
#include "daemon/input/frame_source.h"
#include "daemon/system/stage_clock.h"

namespace farpoint::daemon {

class PacedSource final : public CaptureSource {
 public:
  // `source` has returned `first`, and outlives this object.
  PacedSource(FrameSource* source, const SourceFrame& first, double speed)
      : source_(*source), frame_(first), first_utime_(first.meta.utime), speed_(speed) {}

  [[nodiscard]] CaptureStatus next(const std::atomic<bool>& stop, CapturedImage* image) override;

 private:
  FrameSource& source_;
  SourceFrame frame_;
  const std::int64_t first_utime_;
  const double speed_;
  double start_s_ = 0;
  bool started_ = false;
  StageClock clock_;
};

}  // namespace farpoint::daemon
