// SPDX-License-Identifier: Apache-2.0
// Whether images come: noted by capture, read by the output.
#pragma once

#include <atomic>

#include "daemon/input/counts.h"
#include "slam/spsc_ring.h"

namespace farpoint::daemon {

class CameraPresence {
 public:
  // Before the threads run. Silence counts from here until the first image. now_s: steady clock.
  void begin(double now_s) { note_image(now_s); }

  // Capture thread.
  void note_image(double now_s) {
    last_image_s_.store(now_s, std::memory_order_relaxed);
    away_.store(false, std::memory_order_release);
  }
  // A turn without an image. is_away: the source has no camera now. Returns true when the camera has just
  // gone.
  bool note_nothing(bool is_away, const InputCounts& counts) {
    if (is_away) (void)counts_.push(counts);
    return is_away != away_.exchange(is_away, std::memory_order_acq_rel) && is_away;
  }

  // Output thread.
  [[nodiscard]] bool is_away() const { return away_.load(std::memory_order_acquire); }
  [[nodiscard]] double last_image_s() const { return last_image_s_.load(std::memory_order_relaxed); }
  // Takes the newest counts noted without an image; leaves *counts where there are none.
  void take_counts(InputCounts* counts) {
    while (const InputCounts* noted = counts_.front()) {
      *counts = *noted;
      counts_.pop();
    }
  }

 private:
  // The output looks every 20 ms, capture turns every 100 ms: the newest of a few is enough.
  static constexpr std::size_t kCounts = 4;

  std::atomic<double> last_image_s_{0.0};
  std::atomic<bool> away_{false};
  slam::SpscRing<InputCounts> counts_{kCounts};
};

}  // namespace farpoint::daemon
