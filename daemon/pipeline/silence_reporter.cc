// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/silence_reporter.h"

#include <cmath>

namespace farpoint::daemon {

SilenceReporter::SilenceReporter(FrameReporter* reporter, CameraPresence* presence, double no_camera_after_s)
    : reporter_(*reporter), presence_(*presence), no_camera_after_s_(no_camera_after_s) {}

void SilenceReporter::note_frame(const InputCounts& in) {
  in_ = in;
  next_s_ = 0.0;
}

const FrameOutput* SilenceReporter::report_if_due(double now_s, const OutputCounts& out) {
  if (no_camera_after_s_ <= 0.0) return nullptr;
  presence_.take_counts(&in_);
  const double silent_s = now_s - presence_.last_image_s();
  if (!presence_.is_away() && silent_s < no_camera_after_s_) return nullptr;
  if (now_s < next_s_) return nullptr;
  next_s_ = now_s + 1.0 / reporter_.status_rate_hz();
  const auto utime = static_cast<std::int64_t>(std::llround(1e6 * now_s));
  const auto age_us = static_cast<std::int64_t>(std::llround(1e6 * silent_s));
  return &reporter_.report_silence(utime, age_us, in_, out);
}

}  // namespace farpoint::daemon
