// SPDX-License-Identifier: Apache-2.0
// Passes new exposure options from any thread to the capture thread. The capture thread never waits.
#pragma once

#include <atomic>
#include <mutex>

#include "drivers/camera/camera.h"

namespace farpoint::drivers {

class ExposureMailbox {
 public:
  void put(const ExposureOptions& options) {
    const std::lock_guard lock(mutex_);
    options_ = options;
    full_.store(true, std::memory_order_release);
  }
  // Capture thread: returns false without new options, and while another thread writes them (they follow at
  // the next call).
  [[nodiscard]] bool take(ExposureOptions* options) {
    if (!full_.load(std::memory_order_acquire)) return false;
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock.owns_lock()) return false;
    full_.store(false, std::memory_order_relaxed);
    *options = options_;
    return true;
  }

 private:
  std::mutex mutex_;
  std::atomic<bool> full_{false};
  ExposureOptions options_;
};

}  // namespace farpoint::drivers
