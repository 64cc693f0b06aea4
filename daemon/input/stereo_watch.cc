// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/stereo_watch.h"

#include "daemon/input/camera_counts.h"

namespace farpoint::daemon {

using Side = drivers::StereoPairing::Side;

StereoWatch::StereoWatch(SecondCamera* second, std::int64_t tolerance_us)
    : second_(*second), pairing_({tolerance_us, kPatience_us}) {}

void StereoWatch::note(std::optional<std::int64_t> utime, std::int64_t now_us) {
  while (second_.take_news(&last_)) {
    if (last_.has_image && !pairing_.put(Side::kRight, {last_.utime}, now_us)) ++right_refused_;
    // First the image, then whether more are to be expected: a camera may give its last one and go.
    pairing_.set_away(Side::kRight, !last_.is_streaming);
    take_decided(now_us);
  }
  if (utime && !pairing_.put(Side::kLeft, {*utime}, now_us)) ++left_refused_;
  take_decided(now_us);
}

// The counts are all that is wanted of a frame: the first camera's image has gone on already.
void StereoWatch::take_decided(std::int64_t now_us) {
  for (drivers::StereoFrame decided; pairing_.take(now_us, &decided);) continue;
}

void StereoWatch::add_to(InputCounts* in) const {
  const InputCounts second = input_counts(last_.counts);
  in->images += second.images;
  in->undecodable += second.undecodable;
  in->times_backwards += second.times_backwards;
  in->missing += second.missing;
  in->flagged += second.flagged;
  in->camera_losses += second.camera_losses;
  const drivers::StereoCounts& matched = pairing_.counts();
  in->stereo_pairs = matched.pairs;
  in->stereo_left_alone = matched.left_alone + left_refused_;
  in->stereo_right_alone = matched.right_alone + right_refused_ + last_.untold;
}

}  // namespace farpoint::daemon
