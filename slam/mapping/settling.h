// SPDX-License-Identifier: Apache-2.0
// Whether a map can be used as a measure: its unit is steady, and its adjustments are sound.
#pragma once

#include <optional>

#include "slam/mapping/soundness.h"

namespace farpoint::slam {

// The unit of a young map follows its first baseline, its least certain length. Judges by the last local
// bundle adjustments when the unit holds.
class Settling {
 public:
  // Adjustments in a row that must each change the unit by less than kSteadyChange.
  static constexpr int kSteadyRun = 3;
  static constexpr double kSteadyChange = 0.02;
  // Sound adjustments in a row that must follow an unsound one, also across maps: what bends one map bends
  // the next.
  static constexpr int kSoundRun = 10;

  // A new map is unsettled. The run of sound adjustments is kept.
  void start_map();
  // The new map's unit is given: it holds from the start, unless an unsound adjustment came before.
  void start_metric_map();

  // Takes in one adjustment. `scale_change`: median factor of the inverse depths; nothing is judged without
  // it. An unsound adjustment or a contradicted calibration unsettles at once.
  void note_adjustment(const Soundness& soundness, std::optional<double> scale_change,
                       bool calibration_contradicted);

  [[nodiscard]] bool settled() const { return settled_; }
  // Whether map units are metres.
  [[nodiscard]] bool metric() const { return metric_; }
  // Of the last adjustment of this map; zeros before the first.
  [[nodiscard]] const Soundness& soundness() const { return soundness_; }
  // Whether the map is good enough to refine the calibration from.
  [[nodiscard]] bool fits_well() const { return soundness_.fits_well(settled_); }

 private:
  Soundness soundness_;
  int steady_run_ = 0;
  int sound_run_ = kSoundRun;  // at most kSoundRun
  bool settled_ = false;
  bool metric_ = false;
};

}  // namespace farpoint::slam
