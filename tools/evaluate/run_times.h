// SPDX-License-Identifier: Apache-2.0
// Figures from FARPOINT_TIMING besides tracking's time: age of poses at output, and growth of time and memory
// over a long run.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "tools/common/json.h"

namespace farpoint::tools {

struct TimedFrame {
  std::int64_t utime = 0;
  double tracking_cpu_ms = -1.0, tracking_wall_ms = -1.0;  // negative: not measured
  double latency_ms = -1.0;  // mid-exposure, or when the frame was due, to output; negative in lockstep
  double resident_mb = 0.0;  // of the process; 10^6 bytes
};

struct LatencyMetrics {
  double p50_ms = 0.0, p99_ms = 0.0, max_ms = 0.0;
  // Latency without tracking's own time; NaN if that was not measured.
  double beyond_tracking_p50_ms = 0.0, beyond_tracking_p99_ms = 0.0;
  double frame_period_ms = 0.0;         // median
  std::int64_t later_than_a_frame = 0;  // frames whose latency is longer than a frame period
};

// Of tracking's CPU the 99th percentiles (NaN where it was not measured alone), of memory the values.
struct SteadinessMetrics {
  double second_twentieth_p99_ms = 0.0, last_twentieth_p99_ms = 0.0;
  double tenth_mb = 0.0, half_mb = 0.0,
         end_mb = 0.0;  // resident after a tenth of the frames, half of them, all
};

// Thread CPU time of tracking, of those frames where it was measured alone.
[[nodiscard]] std::vector<double> tracking_times_ms(std::span<const TimedFrame> frames);
// Empty in lockstep.
[[nodiscard]] std::optional<LatencyMetrics> measure_latency(const std::vector<TimedFrame>& frames);
// Empty under 400 frames: a twentieth is then too short for a 99th percentile.
[[nodiscard]] std::optional<SteadinessMetrics> measure_steadiness(const std::vector<TimedFrame>& frames);

[[nodiscard]] Json to_json(const LatencyMetrics& metrics);
[[nodiscard]] Json to_json(const SteadinessMetrics& metrics);

}  // namespace farpoint::tools
