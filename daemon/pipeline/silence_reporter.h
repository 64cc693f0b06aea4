// SPDX-License-Identifier: Apache-2.0
// Reports 'no_camera' at the rate of the status while no image comes.
#pragma once

#include "daemon/output/frame_reporter.h"
#include "daemon/pipeline/camera_presence.h"

namespace farpoint::daemon {

class SilenceReporter {
 public:
  // Both must outlive this object. no_camera_after_s: silence that counts as no camera. 0: nothing is ever
  // reported, since a recording has gaps of its own. A source that has lost its camera is reported at once.
  SilenceReporter(FrameReporter* reporter, CameraPresence* presence, double no_camera_after_s);

  // Output thread, after each reported frame. in: the input's counts as of the frame.
  void note_frame(const InputCounts& in);
  // Output thread, while no frame is in work: reports where that is due. now_s: steady clock. Returns what
  // was reported, null for nothing.
  const FrameOutput* report_if_due(double now_s, const OutputCounts& out);

  // Output thread, or any after its end: the newest counts of the input.
  [[nodiscard]] const InputCounts& input() const { return in_; }

 private:
  FrameReporter& reporter_;
  CameraPresence& presence_;
  const double no_camera_after_s_;
  double next_s_ = 0;
  InputCounts in_;
};

}  // namespace farpoint::daemon
