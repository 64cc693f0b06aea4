// SPDX-License-Identifier: Apache-2.0
// Source of the capture thread: a recording at its pace, or a camera.
#pragma once

#include <atomic>
#include <cstdint>

#include "daemon/input/image_queue.h"

namespace farpoint::daemon {

enum class CaptureStatus : std::uint8_t {
  kImage,    // `image` is filled
  kNothing,  // no image yet; call again
  kAway,     // no image, and the camera is absent
  kEnd,      // the source has ended
};

class CaptureSource {
 public:
  virtual ~CaptureSource() = default;
  // Waits for the next image and fills all fields of `image` except the queue's; `in` and `progress` in every
  // case. The capture thread's only wait: at most 0.1 s, and none after `stop` is set;
  // except while is_opening(). Throws what reading
  // throws.
  [[nodiscard]] virtual CaptureStatus next(const std::atomic<bool>& stop, CapturedImage* image) = 0;
  // Any thread. True while next() opens or closes its device, which may take longer than a watchdog waits, up
  // to the source's own limit. After that limit, and without a device, false.
  [[nodiscard]] virtual bool is_opening() const { return false; }
};

}  // namespace farpoint::daemon
