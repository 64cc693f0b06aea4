// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/camera_wait.h"

#include <poll.h>

namespace farpoint::drivers {

void CameraWait::wait(int fd, int timeout_ms) {
  pollfd descriptor{fd, POLLIN, 0};
  (void)poll(&descriptor, 1, timeout_ms);
}

}  // namespace farpoint::drivers
