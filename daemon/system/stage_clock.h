// Measured times of the stages of one frame, thread CPU and elapsed. The estimator has no clock: the daemon
// measures around it. Measured values go to FARPOINT_TIMING and the last line only, nothing else may depend
// on them.
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

// Bytes of this process in memory, now and at most so far; 0 where the system does not say.
[[nodiscard]] std::int64_t resident_bytes();
[[nodiscard]] std::int64_t peak_resident_bytes();

// deadline_ms: 0 for none.
[[nodiscard]] bool is_late(std::int64_t age_us, double deadline_ms);

// Adds up what each stage of one frame took. A stage may run several times; stages may nest. Listens to an
// estimator's stages.
class StageClock final : public slam::StageListener {
 public:
  static constexpr int kStages = timing_t::STAGES;
  // Mapping: the camera's calibration refined from the map. Behind the stages that timing_t names.
  static constexpr int kCalibration = timing_t::STAGE_FRAME + 1;
  static_assert(kCalibration < kStages);

  StageClock() { new_frame(); }
  void new_frame();
  // `stage` is one of timing_t::STAGE_*.
  void begin(int stage);
  void end(int stage);
  void begin(slam::Stage stage) override;
  void end(slam::Stage stage) override;
  // `stage` counts as not having run.
  void forget(int stage);

  // Negative where the stage did not run in this frame.
  [[nodiscard]] double cpu_ms(int stage) const { return cpu_ms_.at(static_cast<std::size_t>(stage)); }
  [[nodiscard]] double wall_ms(int stage) const { return wall_ms_.at(static_cast<std::size_t>(stage)); }
  // What was measured elsewhere.
  void set(int stage, double cpu_ms, double wall_ms) {
    cpu_ms_.at(static_cast<std::size_t>(stage)) = cpu_ms;
    wall_ms_.at(static_cast<std::size_t>(stage)) = wall_ms;
  }
  // age_us: from when the frame was due to its output; 0 where there is no common clock. deadline_ms: 0 for
  // none.
  [[nodiscard]] timing_t message(std::int64_t utime, std::int64_t sequence, std::int64_t age_us,
                                 double deadline_ms) const;

 private:
  std::array<double, kStages> cpu_ms_{}, wall_ms_{}, cpu_began_s_{}, wall_began_s_{};
};

// Measures one stage for as long as it lives.
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
