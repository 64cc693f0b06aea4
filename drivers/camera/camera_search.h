// SPDX-License-Identifier: Apache-2.0
// Schedules the search for an absent camera and reports each change of state once. Intervals between tries
// double up to 1 s. Capture thread; no heap call.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <utility>

#include "drivers/camera/camera.h"

namespace farpoint::drivers {

class CameraSearch {
 public:
  void on_event(std::function<void(const CameraEvent&)> listener) { tell_ = std::move(listener); }

  // Returns the time until the next try; 0: now. Rounded up, so that a fraction of a millisecond causes no
  // busy loop.
  [[nodiscard]] int wait_ms(std::int64_t now_us) const {
    constexpr std::int64_t kMicrosPerMilli = 1000;
    const std::int64_t left_us = next_try_us_ - now_us;
    return left_us > 0 ? static_cast<int>(left_us / kMicrosPerMilli) + 1 : 0;
  }
  void found(const CameraEvent& streaming) {
    said_ = CameraEvent::Kind::kStreaming;
    tell_(streaming);
  }
  void failed(const CameraEvent& reason, std::int64_t now_us) {
    if (reason.kind != said_) tell_(reason);
    said_ = reason.kind;
    next_try_us_ = now_us + retry_us_;
    retry_us_ = std::min(2 * retry_us_, kLongestRetry_us);
  }
  // Call when images arrive: the next search begins with the shortest interval.
  void works() { retry_us_ = kFirstRetry_us; }

 private:
  static constexpr std::int64_t kFirstRetry_us = 100'000, kLongestRetry_us = 1'000'000;

  std::function<void(const CameraEvent&)> tell_ = [](const CameraEvent&) {};
  std::int64_t retry_us_ = kFirstRetry_us, next_try_us_ = 0;
  CameraEvent::Kind said_ = CameraEvent::Kind::kStreaming;
};

}  // namespace farpoint::drivers
