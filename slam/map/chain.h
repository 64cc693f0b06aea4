// SPDX-License-Identifier: Apache-2.0
// Keyframes of one map in the order of time, and what was measured between each and the next.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "slam/map/landmark.h"
#include "slam/map/wheel_motion.h"

namespace farpoint::slam {

// What lies between two keyframes that follow one another. Pre-integrated measurements of a sensor (wheels,
// IMU) become one member each, with an append() of their own that append() below calls.
struct ChainLink {
  std::int64_t from_utime = 0, to_utime = 0;
  std::uint32_t removed_keyframes = 0;  // that stood in between
  std::optional<WheelMotion> wheels{};  // empty: unknown
  bool wheels_slipped = false;          // the images contradict it

  [[nodiscard]] double duration_s() const { return static_cast<double>(to_utime - from_utime) * 1e-6; }
  // Joins this link with the one behind it; the keyframe between them is removed.
  // Precondition: next.from_utime == to_utime.
  void append(const ChainLink& next);
};

class Chain {
 public:
  explicit Chain(std::size_t keyframes) : nodes_(keyframes) {}

  // Begins a chain, which is a map's.
  void begin(KeyframeHandle first);
  // Hangs a keyframe behind `last`, which must be the end of its chain.
  void extend(KeyframeHandle last, KeyframeHandle keyframe, const ChainLink& link);
  // Takes a keyframe out. The links on both sides of it become one; at an end of the chain its link goes.
  void remove(KeyframeHandle keyframe);

  // Null at the ends of the chain and for a keyframe in no chain.
  [[nodiscard]] KeyframeHandle before(KeyframeHandle keyframe) const { return nodes_[keyframe.index].before; }
  [[nodiscard]] KeyframeHandle after(KeyframeHandle keyframe) const { return nodes_[keyframe.index].after; }
  // Between the keyframe and the one before it. Null for the first one.
  [[nodiscard]] const ChainLink* link_to(KeyframeHandle keyframe) const {
    return before(keyframe).is_null() ? nullptr : &nodes_[keyframe.index].link;
  }
  [[nodiscard]] ChainLink* link_to(KeyframeHandle keyframe) {
    return before(keyframe).is_null() ? nullptr : &nodes_[keyframe.index].link;
  }

 private:
  struct Node {
    KeyframeHandle before, after;
    ChainLink link;  // from `before` to this keyframe
  };
  std::vector<Node> nodes_;  // one a keyframe slot
};

}  // namespace farpoint::slam
