// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/stereo_watch.h"

#include "daemon/input/camera_counts.h"

namespace farpoint::daemon {

using Side = drivers::StereoPairing::Side;

StereoWatch::StereoWatch(CameraReports* further, std::int64_t tolerance_us)
    : further_(further), pairing_({tolerance_us, kPatience_us}) {}

void StereoWatch::note(const std::optional<drivers::CameraFrame>& image, std::int64_t now_us) {
  while (further_->take(&last_)) {
    if (last_.frame && !pairing_.put(Side::kRight, *last_.frame, now_us)) ++right_refused_;
    // First the image, then whether more are to be expected: a camera may give its last one and go.
    pairing_.set_away(Side::kRight, !last_.is_streaming);
    take_decided(now_us);
  }
  if (image && !pairing_.put(Side::kLeft, *image, now_us)) ++left_refused_;
  take_decided(now_us);
}

void StereoWatch::take_decided(std::int64_t now_us) {
  for (drivers::StereoFrame decided; pairing_.take(now_us, &decided);)
    if (decided.is_pair()) skew_us_ = decided.right->utime - decided.left->utime;
}

void StereoWatch::add_to(InputCounts* in) const {
  const InputCounts further = input_counts(last_.counts);
  in->images += further.images;
  in->undecodable += further.undecodable;
  in->times_backwards += further.times_backwards;
  in->times_unknown += further.times_unknown;
  in->missing += further.missing;
  in->flagged += further.flagged;
  in->camera_losses += further.camera_losses;
  const drivers::StereoCounts& matched = pairing_.counts();
  in->stereo_pairs += matched.pairs;
  in->stereo_left_alone += matched.left_alone + left_refused_;
  in->stereo_right_alone += matched.right_alone + right_refused_ + last_.unreported;
  in->stereo_skew_us = skew_us_;
}

}  // namespace farpoint::daemon
