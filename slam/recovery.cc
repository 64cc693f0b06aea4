// SPDX-License-Identifier: Apache-2.0
#include "slam/recovery.h"

#include <algorithm>
#include <utility>

namespace farpoint::slam {

namespace {

// A map is given up after more frames and more time than these. Frames that show nothing do not count.
constexpr int kRelocalisationFrames = 15;
constexpr std::int64_t kRelocalisation_us = 1'500'000;
// Missing frames in a row after which constant velocity is not used as a prior.
constexpr int kGapFrames = 4;

}  // namespace

Recovery::Search Recovery::search(State state, std::int64_t utime) const {
  const bool gap = after_gap(utime);
  if (candidate_.has_value() && !gap) return Search::kConfirm;
  return gap || is_lost(state) ? Search::kRelocalise : Search::kTrack;
}

// A slower pace is learnt at once, a faster one within some frames: a doubled frame is no pace.
void Recovery::note_seen(std::int64_t utime) {
  if (seen_utime_ != kNever) {
    const std::int64_t now_us = utime - seen_utime_;
    interval_us_ = interval_us_ == 0 ? now_us : std::clamp(now_us, interval_us_ * 7 / 8, 2 * interval_us_);
  }
  seen_utime_ = utime;
}

bool Recovery::after_gap(std::int64_t utime) const {
  return interval_us_ > 0 && utime - seen_utime_ > kGapFrames * interval_us_;
}

Recovery::Verdict Recovery::note_lost(std::int64_t utime) {
  if (++lost_frames_ == 1) lost_since_utime_ = utime;
  if (!ever_settled_) return Verdict::kDiscardMap;
  const bool tried_enough =
      lost_frames_ > kRelocalisationFrames && utime - lost_since_utime_ > kRelocalisation_us;
  return tried_enough ? Verdict::kRetireMap : Verdict::kSearchOn;
}

std::optional<RecordedFrame> Recovery::take_candidate() {
  return std::exchange(candidate_, std::nullopt);
}

void Recovery::begin_map() {
  lost_frames_ = 0;
  ever_settled_ = false;
  candidate_.reset();
}

}  // namespace farpoint::slam
