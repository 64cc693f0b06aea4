// What the capture thread takes images from: a recording at its pace, or a camera.
#pragma once

#include <atomic>
#include <cstdint>

#include "daemon/input/image_queue.h"

namespace farpoint::daemon {

enum class CaptureStatus : std::uint8_t {
  kImage,    // `image` is filled
  kNothing,  // none came within a moment; call again
  kAway,     // the same, and it is known that there is no camera
  kEnd,      // no more will come
};

class CaptureSource {
 public:
  virtual ~CaptureSource() = default;
  // Waits for the next image and fills everything of `image` that is not the queue's; `in` and `progress`
  // whatever comes of it. The capture thread's only waiting place: not longer than 0.1 s at a time, and no
  // longer once `stop` is set. Throws what reading throws.
  [[nodiscard]] virtual CaptureStatus next(const std::atomic<bool>& stop, CapturedImage* image) = 0;
};

}  // namespace farpoint::daemon
