// SPDX-License-Identifier: Apache-2.0
// When a frame is worth remembering.
#pragma once

#include "slam/config.h"
#include "slam/map/local_view.h"
#include "slam/tracking/track_outcome.h"

namespace farpoint::slam {

struct KeyframeSituation {
  double since_keyframe_s = 0;
  bool mapping_free = false;  // mapping could start on it at once
};

[[nodiscard]] bool wants_keyframe(const EstimatorConfig& config, const LocalView& view,
                                  const TrackOutcome& outcome, const KeyframeSituation& situation);

}  // namespace farpoint::slam
