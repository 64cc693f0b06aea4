// SPDX-License-Identifier: Apache-2.0
// Looks at a V4L2 camera without setting anything, also beside a program that streams from it.
#pragma once

#include <string>

#include "drivers/v4l2/v4l2_format.h"

namespace farpoint::drivers {

struct V4l2Look {
  std::string path;    // of the node; empty: there is no such camera
  int error = 0;       // errno of the step that failed; 0: none
  std::string what;    // that step, or what was expected
  std::string driver;  // empty where the node did not tell
  OfferedFormat offered;
};

// `system` opens the node; `root` as in CameraPath.
[[nodiscard]] V4l2Look inspect_v4l2(V4l2System* system, const CameraOptions& options,
                                    const std::string& root = "");
// By the kernel, opened for reading. Starts no thread.
[[nodiscard]] V4l2Look inspect_v4l2(const CameraOptions& options);

}  // namespace farpoint::drivers
