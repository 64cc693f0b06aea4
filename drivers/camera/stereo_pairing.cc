// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/stereo_pairing.h"

#include <algorithm>

namespace farpoint::drivers {

CameraFrame StereoPairing::Queue::pop() {
  const CameraFrame image = images.at(first).image;
  first = (first + 1) % kWaiting;
  --count;
  return image;
}

bool StereoPairing::put(Side side, const CameraFrame& image, std::int64_t now_us) {
  Queue& own = queue(side);
  const bool backwards = own.last_utime && image.utime <= *own.last_utime;
  const bool overtaken = gone_utime_ && image.utime <= *gone_utime_;
  if (backwards || overtaken || own.is_full()) {
    ++counts_.late;
    return false;
  }
  own.last_utime = image.utime;
  own.push({image, now_us});
  return true;
}

bool StereoPairing::take(std::int64_t now_us, StereoFrame* frame) {
  if (left_.count > 0 && right_.count > 0) {
    *frame = decide_both();
  } else if (waits_in_vain(left_, right_, now_us)) {
    *frame = {left_.pop(), std::nullopt};
  } else if (waits_in_vain(right_, left_, now_us)) {
    *frame = {std::nullopt, right_.pop()};
  } else {
    return false;
  }
  gone_utime_ = std::max(gone_utime_.value_or(frame->utime()), frame->utime());
  count(*frame);
  return true;
}

// Each side's times grow, so that the older of two oldest images that are too far apart has no partner any
// more.
StereoFrame StereoPairing::decide_both() {
  const std::int64_t ahead_us = right_.front()->image.utime - left_.front()->image.utime;
  StereoFrame frame;
  if (ahead_us >= -options_.tolerance_us) frame.left = left_.pop();
  if (ahead_us <= options_.tolerance_us) frame.right = right_.pop();
  return frame;
}

bool StereoPairing::waits_in_vain(const Queue& own, const Queue& other, std::int64_t now_us) const {
  if (own.count == 0) return false;
  // The other camera is past it already: its images were given out.
  const bool passed =
      other.last_utime && *other.last_utime > own.front()->image.utime + options_.tolerance_us;
  return other.away || passed || own.is_full() || now_us - own.front()->came_us >= options_.patience_us;
}

std::optional<std::int64_t> StereoPairing::due_us() const {
  const Waiting* waiting = left_.count > 0 ? left_.front() : right_.front();
  if (waiting == nullptr) return std::nullopt;
  return waiting->came_us + options_.patience_us;
}

void StereoPairing::count(const StereoFrame& frame) {
  if (frame.is_pair())
    ++counts_.pairs;
  else if (frame.left)
    ++counts_.left_alone;
  else
    ++counts_.right_alone;
}

}  // namespace farpoint::drivers
