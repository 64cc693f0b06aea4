// SPDX-License-Identifier: Apache-2.0
#include "slam/validity.h"

#include <algorithm>
#include <cmath>

namespace farpoint::slam {

namespace {

double share_of(const TrackOutcome& o) {
  const bool known = o.confirmed_matches >= 2 * Validity::kLeastKnown;
  const int inliers = known ? o.confirmed_inliers : o.inliers,
            matches = known ? o.confirmed_matches : o.matches;
  return static_cast<double>(inliers) / std::max(matches, 1);
}

}  // namespace

void Validity::begin_map() {
  agreed_ = true;
  doubt_ = false;
  refusal_ = {};
}

bool Validity::agrees(std::int64_t utime, const TrackOutcome& outcome, double repeated_share) {
  const bool frozen = repeated_share > kFrozenShare;
  const bool few = outcome.confirmed_inliers < kLeastKnown;
  const double share = share_of(outcome), least = agreed_ ? kDoubtedShare : kAgreedShare;
  // A change of mind: agreed_ turns once it has lasted.
  const bool changes = (frozen || few || share < least) == agreed_;
  if (changes && !doubt_) since_utime_ = utime;
  doubt_ = changes;
  if (changes && 1e-6 * static_cast<double>(utime - since_utime_) >= (agreed_ ? kDoubt_s : kAgreement_s)) {
    agreed_ = !agreed_;
    doubt_ = false;
  }
  if (agreed_) return true;
  if (frozen)
    refusal_ = {Reason::kFrozenImage, repeated_share, kFrozenShare};
  else
    refusal_ =
        few ? Refusal{Reason::kFewLandmarks, static_cast<double>(outcome.confirmed_inliers), kLeastKnown}
            : Refusal{Reason::kDisagreement, share, kAgreedShare};
  return false;
}

bool Validity::note_tracked(std::int64_t utime, const MapJudgement& judgement, const TrackOutcome& outcome,
                            double repeated_share) {
  refusal_ = {};
  const bool agreed = agrees(utime, outcome, repeated_share);
  if (agreed) refusal_ = refusal_of(judgement, utime);
  return agreed && refusal_.reason == Reason::kNone;
}

Refusal refusal_of(const MapJudgement& j, std::int64_t utime) {
  if (j.calibration_contradicted) return {.reason = Reason::kCalibrationContradicted};
  if (!j.sound) return j.unsound;
  if (!j.steady)
    return {Reason::kUnitUnsteady, std::fabs(std::log(j.scale_change)), MapJudgement::kSteadyChange};
  const double sound_s = j.sound_time_s(utime);
  if (sound_s < MapJudgement::kSoundTime_s) return {Reason::kSoundAgain, sound_s, MapJudgement::kSoundTime_s};
  return {};
}

}  // namespace farpoint::slam
