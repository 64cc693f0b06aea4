// SPDX-License-Identifier: Apache-2.0
// What an operator sees of the tracked camera of a live run.
#pragma once

#include <cstdint>

#include "drivers/camera/camera.h"

namespace farpoint::daemon {

struct CameraNote {
  // Of the running stream; kAuto and 0: unknown.
  drivers::CameraFormat format = drivers::CameraFormat::kAuto;
  double rate_hz = 0;
  // Of the image; -1: unknown.
  std::int32_t exposure_us = -1;
  float gain = -1.0F;
};

}  // namespace farpoint::daemon
