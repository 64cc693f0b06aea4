// SPDX-License-Identifier: Apache-2.0
// Neighbours of a keyframe in the covisibility graph.
#pragma once

#include <cstddef>
#include <vector>

#include "slam/map/map.h"

namespace farpoint::slam {

// The first `limit` covisible keyframes, strongest first. Precondition: the keyframe is alive.
[[nodiscard]] inline std::vector<KeyframeHandle> neighbours_of(const Map& map, KeyframeHandle keyframe,
                                                               std::size_t limit) {
  std::vector<KeyframeHandle> out;
  for (const Covisible& c : map.keyframes()[keyframe].covisible) {
    if (out.size() == limit) break;
    out.push_back(c.keyframe);
  }
  return out;
}

}  // namespace farpoint::slam
