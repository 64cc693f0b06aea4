// A capture thread's one wait and its clocks, so that tests can let time pass.
#pragma once

#include "drivers/camera/camera_time.h"

namespace farpoint::drivers {

class CameraWait {
 public:
  virtual ~CameraWait() = default;
  // Until fd is readable, or timeout_ms are over, or a signal came. fd -1: only waits.
  virtual void wait(int fd, int timeout_ms);
  [[nodiscard]] virtual ClockReadings clocks() { return read_clocks(); }
};

}  // namespace farpoint::drivers
