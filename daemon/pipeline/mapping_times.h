// SPDX-License-Identifier: Apache-2.0
// Times of mapping's stages, from the mapping thread to the output thread.
#pragma once

#include <cstddef>

#include "daemon/system/stage_clock.h"
#include "slam/spsc_ring.h"
#include "slam/stages.h"

namespace farpoint::daemon {

// Listens to an estimator whose halves run on two threads: tracking's stages, which come on another thread,
// have no effect, since their clock would cost tracking system calls.
class MappingTimes final : public slam::StageListener {
 public:
  void begin(slam::Stage stage) override {
    if (is_of_mapping(stage)) clock_.begin(stage);
  }
  void end(slam::Stage stage) override {
    if (is_of_mapping(stage)) clock_.end(stage);
  }

  // Mapping's thread, after each reply. Hands over the times since the last hand-over once a keyframe is
  // done; a full ring keeps them for the next one.
  void hand_over() {
    if (is_between_replies() || !ring_.push(clock_)) return;
    clock_.new_frame();
  }
  // Output's thread: adds what was handed over since the last call to the stages of `clock`.
  void add_to(StageClock* clock) {
    while (const StageClock* times = ring_.front()) {
      for (int stage = 0; stage < StageClock::kStages; ++stage) clock->add(stage, *times);
      ring_.pop();
    }
  }

 private:
  // Keyframes between two frames are one, seldom more; output reports at least every frame.
  static constexpr std::size_t kKeyframes = 16;

  static bool is_of_mapping(slam::Stage stage) { return stage >= slam::Stage::kMapping; }
  // A keyframe's first reply has its new points, its second one the adjusted map.
  [[nodiscard]] bool is_between_replies() const {
    return clock_.cpu_ms(timing_t::STAGE_TRIANGULATION) >= 0.0 &&
           clock_.cpu_ms(timing_t::STAGE_LOCAL_BA) < 0.0;
  }

  StageClock clock_;
  slam::SpscRing<StageClock> ring_{kKeyframes};
};

}  // namespace farpoint::daemon
