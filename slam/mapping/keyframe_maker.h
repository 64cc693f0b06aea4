// SPDX-License-Identifier: Apache-2.0
// Makes keyframes of frames.
#pragma once

#include <cstdint>

#include "slam/map/frame.h"
#include "slam/map/map.h"
#include "slam/mapping/counts.h"

namespace farpoint::slam {

class KeyframeMaker {
 public:
  // Both must outlive this.
  KeyframeMaker(Map* map, MappingCounts* counts) : map_(*map), counts_(*counts) {}

  // Copies the frame into the map: it becomes the newest keyframe. A further camera's view that has pixels
  // alone gets room for as many features as the first camera has: feature i is where it shows feature i of
  // the first. Null where the map is full.
  KeyframeHandle make(const Frame& frame, const SE3& T_world_body, std::int32_t map_id);

  // The keyframe made last; the handle ends when the map removes it.
  [[nodiscard]] KeyframeHandle newest() const { return newest_; }
  // 0 before the first.
  [[nodiscard]] std::uint64_t newest_id() const { return newest_id_; }

 private:
  [[nodiscard]] KeyframeView copy(const FrameView& view, const Camera& camera);
  [[nodiscard]] KeyframeView room_beside(const FrameView& first, const FrameView& further);

  Map& map_;
  MappingCounts& counts_;
  KeyframeHandle newest_;
  std::uint64_t newest_id_ = 0;
};

}  // namespace farpoint::slam
