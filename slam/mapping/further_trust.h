// SPDX-License-Identifier: Apache-2.0
// How much the further cameras' measurements count beside the first camera's.
//
// A camera may move against the rig: a mount bends, an exposure is late. All its measurements of a keyframe
// then share an error, seen as a field in their residuals. N of them weigh as one measurement of the field's
// size: their sigmas grow by sqrt(1 + N field^2 / sigma^2). The first camera then determines the map's shape,
// and the pair its unit, averaged over many keyframes. Source: a recording of a car whose second camera turns
// by 4 px in a second.
#pragma once

#include <cstdint>

#include "slam/mapping/soundness.h"

namespace farpoint::slam {

class FurtherTrust {
 public:
  // A new map: further cameras count in full.
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
