// SPDX-License-Identifier: Apache-2.0
// Passes a live camera's events from its capture thread to the thread that logs them.
#pragma once

#include <cstddef>

#include "drivers/camera/camera.h"
#include "slam/spsc_ring.h"

namespace farpoint::daemon {

class CameraEvents {
 public:
  // Capture thread.
  void put(const drivers::CameraEvent& event) { (void)events_.push(event); }
  // One other thread: takes the oldest new event; false without one.
  [[nodiscard]] bool take(drivers::CameraEvent* event) {
    const drivers::CameraEvent* oldest = events_.front();
    if (oldest == nullptr) return false;
    *event = *oldest;
    events_.pop();
    return true;
  }

 private:
  static constexpr std::size_t kEvents = 64;  // a full ring drops new events and keeps old ones
  slam::SpscRing<drivers::CameraEvent> events_{kEvents};
};

}  // namespace farpoint::daemon
