// From the times of single frames to what `farpoint bench` prints.
//
// Times mean something only against those of known work on the same machine at the same moment: the
// yardstick, cv::ORB on the same frame, timed right after it.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "daemon/system/stage_clock.h"
#include "tools/common/json.h"

namespace farpoint::tools {

// What one frame took. Stages by timing_t::STAGE_*, negative where one did not run.
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
  std::size_t frames = 0;  // in which it ran
  double p50_ms = 0, p99_ms = 0, max_ms = 0;
};

struct BenchReport {
  double yardstick_p50_ms = 0, yardstick_p99_ms = 0;
  std::vector<BenchStage> stages;  // those that ran at all: thread CPU, then those of wall clock (NAME_wall)
  double process_cpu_ms = 0;       // mean of a frame
  std::size_t frames = 0;          // of all passes that count
  std::size_t passes = 0, passes_run = 0;
  double disturbance = 0;  // of the worst pass that counts
};

// A pass whose disturbance is larger was not alone on the machine.
inline constexpr double kDisturbed = 1.25;

// How much slower the yardstick ran in each pass than it can: the 90th percentile, over the frames, of its
// time against the least time it took on that frame in any pass. 1 is perfect rest. What makes one frame
// dearer than another (more corners) drops out. Passes must have equally many frames.
[[nodiscard]] std::vector<double> disturbances(const std::vector<BenchPass>& passes);

// Whether `count` passes without disturbance are there.
[[nodiscard]] bool enough_calm_passes(const std::vector<BenchPass>& passes, std::size_t count);

// Pools the `count` calmest passes. Precondition: there are as many, each with frames.
[[nodiscard]] BenchReport make_report(const std::vector<BenchPass>& passes, std::size_t count);

// The shape that DESIGN.md promises; a stage's yardsticks are its milliseconds over the yardstick's p50.
[[nodiscard]] Json to_json(const BenchReport& report);
[[nodiscard]] std::string to_text(const BenchReport& report);

}  // namespace farpoint::tools
