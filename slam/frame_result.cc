// SPDX-License-Identifier: Apache-2.0
#include "slam/frame_result.h"

namespace farpoint::slam {

const char* to_string(State state) {
  switch (state) {
    case State::kStarting:
      return "starting";
    case State::kInitialising:
      return "initialising";
    case State::kSettling:
      return "settling";
    case State::kTracking:
      return "tracking";
    case State::kDegraded:
      return "degraded";
    case State::kLost:
      return "lost";
    case State::kRelocalising:
      return "relocalising";
    case State::kNoCamera:
      return "no_camera";
  }
  return "unknown";
}

}  // namespace farpoint::slam
