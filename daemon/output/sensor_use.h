// SPDX-License-Identifier: Apache-2.0
// Which sensors a pose rests on, for buses, status and texts.
#pragma once

#include "ipc/can_codec.h"
#include "slam/frame_result.h"

namespace farpoint::daemon {

// Values are those of status_t too.
[[nodiscard]] inline ipc::CanSensorUse wheel_use(const slam::FrameResult& result) {
  switch (result.wheels) {
    case slam::WheelTrust::kNone:
      break;
    case slam::WheelTrust::kTrusted:
      return ipc::CanSensorUse::kUsed;
    case slam::WheelTrust::kContradicted:
      return ipc::CanSensorUse::kContradicted;
  }
  return result.taken.wheels > 0 ? ipc::CanSensorUse::kStarting : ipc::CanSensorUse::kNone;
}

}  // namespace farpoint::daemon
