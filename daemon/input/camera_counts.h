// SPDX-License-Identifier: Apache-2.0
// Converts one live camera's counts to InputCounts.
#pragma once

#include "daemon/input/counts.h"
#include "drivers/camera/camera.h"

namespace farpoint::daemon {

[[nodiscard]] inline InputCounts input_counts(const drivers::CameraCounts& c) {
  InputCounts in;
  in.images = c.frames + c.flagged + c.undecodable + c.times_backwards;
  in.undecodable = c.undecodable;
  in.times_backwards = c.times_backwards;
  in.times_unknown = c.times_unknown;
  in.missing = c.missing;
  in.flagged = c.flagged;
  in.camera_losses = c.lost + c.stalled;
  return in;
}

}  // namespace farpoint::daemon
