// SPDX-License-Identifier: Apache-2.0
// Whether a map can be used as a measure: its unit is steady, and its adjustments are sound.
#pragma once

#include <cstdint>
#include <optional>

#include "slam/map/map_judgement.h"
#include "slam/mapping/further_trust.h"
#include "slam/mapping/soundness.h"
#include "slam/solver/motion_factors.h"

namespace farpoint::slam {

// The unit of a young map follows its first baseline, its least certain length. Judges by the last local
// bundle adjustments when the unit holds.
class Settling {
 public:
  // Adjustments in a row that must each change the unit by less than MapJudgement::kSteadyChange.
  static constexpr int kSteadyRun = 3;
  // Longest time that one adjustment vouches for, up to the next.
  static constexpr double kLongestGap_s = 0.5;

  // A new map is unsteady. The time of sound adjustments goes on: what bends one map bends the next.
  void start_map();
  // The new map's unit is given: it holds from the start, unless an unsound adjustment came before.
  void start_metric_map();

  // Takes in one adjustment, whose newest keyframe is of `utime`. `scale_change`: median factor of the
  // inverse depths; nothing is judged without it. An unsound adjustment or a contradicted calibration makes
  // the map unsound at once, for MapJudgement::kSoundTime_s.
  void note_adjustment(const Soundness& soundness, std::optional<double> scale_change,
                       bool calibration_contradicted, std::int64_t utime);

  // Takes in what another sensor says. Its metre is the map's unit from here on.
  void note_motion(const MotionVerdict& verdict);

  // Of the further cameras' sigmas.
  [[nodiscard]] double further_sigma_factor() const { return judgement_.further_sigma_factor; }
  [[nodiscard]] const MapJudgement& judgement() const { return judgement_; }
  // Of the last adjustment of this map; zeros before the first.
  [[nodiscard]] const Soundness& soundness() const { return soundness_; }
  // Whether the map is good enough to refine the calibration from.
  [[nodiscard]] bool fits_well() const { return soundness_.fits_well(judgement_.steady && judgement_.sound); }

 private:
  Soundness soundness_;
  FurtherTrust further_;
  MapJudgement judgement_;
  int steady_run_ = 0;
  bool has_adjustment_ = false;  // of this map
};

}  // namespace farpoint::slam
