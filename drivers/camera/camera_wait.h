// SPDX-License-Identifier: Apache-2.0
// The one wait of a capture thread and its clocks. Tests replace both.
#pragma once

#include "drivers/camera/camera_time.h"

namespace farpoint::drivers {

class CameraWait {
 public:
  virtual ~CameraWait() = default;
  // Returns when fd is readable, after timeout_ms, or at a signal. fd -1: timeout only.
  virtual void wait(int fd, int timeout_ms);
  [[nodiscard]] virtual ClockReadings clocks() { return read_clocks(); }
};

}  // namespace farpoint::drivers
