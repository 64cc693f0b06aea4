// SPDX-License-Identifier: Apache-2.0
#include "slam/map/chain.h"

namespace farpoint::slam {

void ChainLink::append(const ChainLink& next) {
  // A motion of which one part slipped measures nothing.
  const bool known = wheels && next.wheels && !wheels_slipped && !next.wheels_slipped;
  if (known)
    wheels->append(*next.wheels);
  else
    wheels.reset();
  wheels_slipped = false;
  to_utime = next.to_utime;
  removed_keyframes += next.removed_keyframes + 1;
}

void Chain::begin(KeyframeHandle first) {
  nodes_[first.index] = {};
}

void Chain::extend(KeyframeHandle last, KeyframeHandle keyframe, const ChainLink& link) {
  nodes_[keyframe.index] = {last, {}, link};
  nodes_[last.index].after = keyframe;
}

void Chain::remove(KeyframeHandle keyframe) {
  Node& node = nodes_[keyframe.index];
  if (!node.before.is_null()) nodes_[node.before.index].after = node.after;
  if (!node.after.is_null()) {
    Node& after = nodes_[node.after.index];
    after.before = node.before;
    ChainLink joined = node.link;
    joined.append(after.link);
    after.link = node.before.is_null() ? ChainLink{} : joined;
  }
  node = {};
}

}  // namespace farpoint::slam
