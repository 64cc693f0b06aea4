// SPDX-License-Identifier: Apache-2.0
// What tracking hands to the output of one frame: by value, so that nothing of tracking's is read later.
#pragma once

#include <cstdint>

#include "daemon/input/camera_note.h"
#include "daemon/input/counts.h"
#include "daemon/system/stage_clock.h"
#include "slam/frame_result.h"

namespace farpoint::daemon {

// What a frame met by chance in a threaded run; all zero in lockstep.
struct FrameChance {
  std::int64_t frames_dropped = 0;  // so far
  std::int64_t age_us = 0;          // from when the frame was due to its output
  std::int32_t capture_queue = 0, publish_queue = 0;
  std::int32_t features_asked = 0;  // 0: as configured
};

struct FramePackage {
  slam::FrameResult result;
  slam::EstimatorCounts counts;
  InputCounts in;
  CameraNote camera;  // live
  FrameChance chance;
  StageClock clock;
  double due_s = 0;        // steady clock; threaded runs
  double progress = -1.0;  // of the source
};

}  // namespace farpoint::daemon
