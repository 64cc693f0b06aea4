// SPDX-License-Identifier: Apache-2.0
// Measures the stages of one frame, thread CPU and elapsed time. The estimator has no clock, so the daemon
// measures around it. Measured values go to FARPOINT_TIMING and the last line only.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "ipc/message.h"
#include "slam/stages.h"

namespace farpoint::daemon {

// Seconds since an arbitrary start.
[[nodiscard]] double thread_cpu_s();
[[nodiscard]] double process_cpu_s();
[[nodiscard]] double steady_s();

// Resident bytes of this process, now and at most so far; 0 if unknown.
[[nodiscard]] std::int64_t resident_bytes();
[[nodiscard]] std::int64_t peak_resident_bytes();

// deadline_ms: 0 for none.
[[nodiscard]] bool is_late(std::int64_t age_us, double deadline_ms);

// Sums the times of each stage of one frame. A stage may run several times; stages may nest. Receives an
// estimator's stages.
class StageClock final : public slam::StageListener {
 public:
  static constexpr int kStages = timing_t::STAGES;
  // Mapping: refinement of the calibration. Follows the stages of timing_t.
  static constexpr int kCalibration = timing_t::STAGE_FRAME + 1;
  static_assert(kCalibration < kStages);

  StageClock() { new_frame(); }
  void new_frame();
  // `stage` is one of timing_t::STAGE_*.
  void begin(int stage);
  void end(int stage);
  void begin(slam::Stage stage) override;
  void end(slam::Stage stage) override;
  // Marks `stage` as not run.
  void forget(int stage);

  // Negative for a stage that did not run in this frame.
  [[nodiscard]] double cpu_ms(int stage) const { return cpu_ms_.at(static_cast<std::size_t>(stage)); }
  [[nodiscard]] double wall_ms(int stage) const { return wall_ms_.at(static_cast<std::size_t>(stage)); }
  // Sets a time measured elsewhere.
  void set(int stage, double cpu_ms, double wall_ms) {
    cpu_ms_.at(static_cast<std::size_t>(stage)) = cpu_ms;
    wall_ms_.at(static_cast<std::size_t>(stage)) = wall_ms;
  }
  // Adds the times of `stage` in another clock; no effect where the stage did not run there.
  void add(int stage, const StageClock& other);
  // age_us: from the frame's due time to its output; 0 without a common clock. deadline_ms: 0 for none.
  [[nodiscard]] timing_t message(std::int64_t utime, std::int64_t sequence, std::int64_t age_us,
                                 double deadline_ms) const;

 private:
  std::array<double, kStages> cpu_ms_{}, wall_ms_{}, cpu_began_s_{}, wall_began_s_{};
};

// Measures one stage during its life.
class StageScope {
 public:
  StageScope(StageClock* clock, int stage) : clock_(clock), stage_(stage) { clock_->begin(stage_); }
  ~StageScope() { clock_->end(stage_); }
  StageScope(const StageScope&) = delete;
  StageScope& operator=(const StageScope&) = delete;

 private:
  StageClock* clock_;
  int stage_;
};

}  // namespace farpoint::daemon
