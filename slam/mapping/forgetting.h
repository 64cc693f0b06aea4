// SPDX-License-Identifier: Apache-2.0
// What the map forgets: redundant keyframes, and the oldest ones where memory ends.
#pragma once

#include <cstdint>
#include <vector>

#include "slam/map/map.h"
#include "slam/mapping/counts.h"

namespace farpoint::slam {

// Removes those of the candidates that are redundant: nine tenths of what they see, three other keyframes see
// at least as finely. The newest few stay.
void cull_redundant_keyframes(const std::vector<KeyframeHandle>& candidates, std::uint64_t newest_id,
                              Map* map, MappingCounts* counts);

// Thins every keyframe except the newest `images` ones (Map::thin_keyframe). Removes the oldest keyframes
// (never `newest`) where a pool is full, and landmarks that only they saw.
void limit_memory(int images, KeyframeHandle newest, std::uint64_t newest_id, Map* map,
                  MappingCounts* counts);

}  // namespace farpoint::slam
