// SPDX-License-Identifier: Apache-2.0
// Computes the output of `farpoint bench` from the times of single frames.
//
// Times are comparable only with those of known work on the same machine at the same moment. The yardstick is
// cv::ORB on the same frame, timed right after it.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "daemon/system/stage_clock.h"
#include "tools/common/json.h"

namespace farpoint::tools {

// Times of one frame. Stages by timing_t::STAGE_*, negative for one that did not run.
struct FrameTimes {
  std::array<double, daemon::StageClock::kStages> cpu_ms{}, wall_ms{};
  double process_cpu_ms = 0;  // decoding, tracking and mapping, of all threads
  double yardstick_ms = 0;    // thread CPU
};

// One run over the recording.
struct BenchPass {
  std::vector<FrameTimes> frames;
};

struct BenchStage {
  std::string name;
  std::size_t frames = 0;  // frames in which it ran
  double p50_ms = 0, p99_ms = 0, max_ms = 0;
};

struct BenchReport {
  double yardstick_p50_ms = 0, yardstick_p99_ms = 0;
  std::vector<BenchStage> stages;  // those that ran at all: thread CPU, then those of wall clock (NAME_wall)
  double process_cpu_ms = 0;       // mean of a frame
  std::size_t frames = 0;          // of all pooled passes
  std::size_t passes = 0, passes_run = 0;
  double disturbance = 0;  // of the worst pooled pass
};

// A pass above this disturbance shared the machine with other work.
inline constexpr double kDisturbed = 1.25;

// Slowdown of the yardstick in each pass: the 90th percentile, over the frames, of its time over its least
// time on that frame in any pass. 1 is perfect rest. Differences between frames (more corners) cancel.
// Precondition: passes of equal length.
[[nodiscard]] std::vector<double> disturbances(const std::vector<BenchPass>& passes);

// Returns true with `count` undisturbed passes.
[[nodiscard]] bool enough_calm_passes(const std::vector<BenchPass>& passes, std::size_t count);

// Pools the `count` calmest passes. Precondition: at least that number, each with frames.
[[nodiscard]] BenchReport make_report(const std::vector<BenchPass>& passes, std::size_t count);

// JSON of --json. A stage's yardsticks are its milliseconds over the yardstick's p50.
[[nodiscard]] Json to_json(const BenchReport& report);
[[nodiscard]] std::string to_text(const BenchReport& report);

}  // namespace farpoint::tools
