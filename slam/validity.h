// SPDX-License-Identifier: Apache-2.0
// Whether tracked poses are valid, with hysteresis in seconds, and why not.
#pragma once

#include <cstdint>

#include "slam/map/map_judgement.h"
#include "slam/map/refusal.h"
#include "slam/tracking/track_outcome.h"

namespace farpoint::slam {

class Validity {
 public:
  // Inliers among the landmarks of known depth: rigid scenes show 0.7 and more. Below the first a valid pose
  // is doubted, above the second an invalid one may become valid.
  static constexpr double kDoubtedShare = 0.55, kAgreedShare = 0.65;
  // Fewest landmarks of known depth that hold a pose.
  static constexpr int kLeastKnown = 12;
  // A doubt lasts for so long before the pose is called invalid: one frame of a passing bus is none.
  static constexpr double kDoubt_s = 0.3;
  // After an invalid pose: agreement for so long.
  static constexpr double kAgreement_s = 0.5;

  // Share of the features that repeat those of the frame before, bit for bit, above which a part of the
  // image is frozen.
  static constexpr double kFrozenShare = 0.15;

  // A frame tracked at `utime` against a map of this judgement. `repeated_share`: of its features; 0 where
  // the vehicle stood before. Returns whether its pose is valid.
  bool note_tracked(std::int64_t utime, const MapJudgement& judgement, const TrackOutcome& outcome,
                    double repeated_share);
  // A frame without a pose. A place found again is on trial: no further wait is added.
  void note_lost() { doubt_ = false; }
  // A new map: its first frames wait for its judgement.
  void begin_map();

  [[nodiscard]] const Refusal& refusal() const { return refusal_; }

 private:
  [[nodiscard]] bool agrees(std::int64_t utime, const TrackOutcome& outcome, double repeated_share);

  bool agreed_ = true, doubt_ = false;
  std::int64_t since_utime_ = 0;  // of the doubt, or of the agreement that ends one
  Refusal refusal_;
};

// Why the map cannot be used at `utime`; no reason where it can.
[[nodiscard]] Refusal refusal_of(const MapJudgement& judgement, std::int64_t utime);

}  // namespace farpoint::slam
