// SPDX-License-Identifier: Apache-2.0
// How much the further cameras' measurements count beside the first camera's.
//
// A camera that moves against the rig (a mount that bends, an exposure at another time) has an error that all
// its measurements of one keyframe share: a field in their residuals. N of them then know no more than one
// measurement with the field's size as its error, and their sigmas grow by sqrt(1 + N field^2 / sigma^2). So
// the first camera keeps the map's shape, and the pair holds its unit by the average of many keyframes. Seen
// on a recording of a car whose second camera turns by 4 px in a second.
#pragma once

#include <cstdint>

#include "slam/mapping/soundness.h"

namespace farpoint::slam {

class FurtherTrust {
 public:
  // A new map: nothing speaks against the cameras.
  void start_map() { *this = {}; }
  // Takes one adjustment, whose newest keyframe is of `utime`. Its sigmas were larger by sigma_factor().
  void note_adjustment(const Soundness& soundness, std::int64_t utime);

  // Of the further cameras' sigmas, from 1 on.
  [[nodiscard]] double sigma_factor() const { return sigma_factor_; }

 private:
  double shared_px2_ = 0;  // square of the field beyond what sound rigs leave
  double sigma_factor_ = 1.0;
  std::int64_t utime_ = 0;
};

}  // namespace farpoint::slam
