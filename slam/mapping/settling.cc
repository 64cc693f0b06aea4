// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/settling.h"

#include <algorithm>
#include <cmath>

namespace farpoint::slam {

void Settling::start_map() {
  const double sound_s = judgement_.sound ? judgement_.sound_s : 0.0;
  judgement_ = {};
  judgement_.sound_s = sound_s;
  soundness_ = {};
  further_.start_map();
  steady_run_ = 0;
  has_adjustment_ = false;
}

void Settling::start_metric_map() {
  judgement_.metric = judgement_.steady = true;
  steady_run_ = kSteadyRun;
}

void Settling::note_adjustment(const Soundness& soundness, std::optional<double> scale_change,
                               bool calibration_contradicted, std::int64_t utime) {
  soundness_ = soundness;
  further_.note_adjustment(soundness, utime);
  judgement_.further_sigma_factor = further_.sigma_factor();
  if (!scale_change) return;
  MapJudgement& j = judgement_;
  const double gap_s =
      has_adjustment_ && j.sound ? 1e-6 * static_cast<double>(utime - j.adjusted_utime) : 0.0;
  has_adjustment_ = true;
  // A rolling shutter under fast rotation, a moving scene or a wrong calibration bends the map to fit: its
  // poses are wrong, however many inliers they have.
  j.unsound = soundness.refusal(j.steady && j.sound);
  j.sound = j.unsound.reason == Reason::kNone && !calibration_contradicted;
  j.sound_s =
      j.sound ? std::min(j.sound_s + std::clamp(gap_s, 0.0, kLongestGap_s), MapJudgement::kSoundTime_s) : 0.0;
  j.calibration_contradicted = calibration_contradicted;
  j.adjusted_utime = utime;
  j.scale_change = *scale_change;
  const bool steady = std::fabs(std::log(*scale_change)) < MapJudgement::kSteadyChange;
  steady_run_ = steady ? steady_run_ + 1 : 0;
  if (steady_run_ >= kSteadyRun) j.steady = true;
}

void Settling::note_motion(const MotionVerdict& verdict) {
  judgement_.wheels = verdict.trust;
  judgement_.wheel_factor = verdict.wheel_factor;
  judgement_.unit_sigma = verdict.unit_sigma;
  if (verdict.metres_per_unit) judgement_.metric = true;
}

}  // namespace farpoint::slam
