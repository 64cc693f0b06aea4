// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/settling.h"

#include <algorithm>
#include <cmath>

namespace farpoint::slam {

void Settling::start_map() {
  settled_ = false;
  metric_ = false;
  steady_run_ = 0;
  soundness_ = {};
}

void Settling::start_metric_map() {
  metric_ = true;
  steady_run_ = kSteadyRun;
  settled_ = sound_run_ == kSoundRun;
}

void Settling::note_adjustment(const Soundness& soundness, std::optional<double> scale_change,
                               bool calibration_contradicted) {
  soundness_ = soundness;
  if (!scale_change) return;
  if (!soundness_.holds(settled_) || calibration_contradicted) {
    // A rolling shutter under fast rotation, a moving scene or a wrong calibration bends the map to fit: its
    // poses are wrong, however many inliers they have.
    settled_ = false;
    steady_run_ = 0;
    sound_run_ = 0;
    return;
  }
  const bool steady = std::fabs(std::log(*scale_change)) < kSteadyChange;
  sound_run_ = std::min(sound_run_ + 1, kSoundRun);
  steady_run_ = steady ? steady_run_ + 1 : 0;
  if (steady_run_ >= kSteadyRun && sound_run_ == kSoundRun) settled_ = true;
}

}  // namespace farpoint::slam
