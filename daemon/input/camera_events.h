// What happens to a live camera, from its capture thread to the one that says it.
#pragma once

#include <cstddef>

#include "drivers/camera/camera.h"
#include "slam/spsc_ring.h"

namespace farpoint::daemon {

class CameraEvents {
 public:
  // Before the first image; this outlives the camera.
  void listen_to(drivers::Camera* camera) {
    camera->on_event([this](const drivers::CameraEvent& event) { (void)events_.push(event); });
  }

  // Any one other thread: what has happened since, oldest first; false where nothing has.
  [[nodiscard]] bool take(drivers::CameraEvent* event) {
    const drivers::CameraEvent* oldest = events_.front();
    if (oldest == nullptr) return false;
    *event = *oldest;
    events_.pop();
    return true;
  }

 private:
  static constexpr std::size_t kEvents = 64;  // older ones are what an operator wants: newer give way
  slam::SpscRing<drivers::CameraEvent> events_{kEvents};
};

}  // namespace farpoint::daemon
