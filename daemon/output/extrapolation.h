// SPDX-License-Identifier: Apache-2.0
// A pose predicted to a moment after its image.
#pragma once

#include "daemon/output/pose_sink.h"

namespace farpoint::daemon {

// The frame dt_s later, where the body keeps its velocity in body axes: poses move, the age grows. A frame
// without a valid pose only grows older.
[[nodiscard]] FrameOutput extrapolate(const FrameOutput& frame, double dt_s);

}  // namespace farpoint::daemon
