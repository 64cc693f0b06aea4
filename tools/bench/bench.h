// Runs a recording through the estimator, frame by frame beside the yardstick.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "daemon/config/config.h"
#include "tools/bench/report.h"

namespace farpoint::tools {

struct BenchOptions {
  std::string log;
  std::size_t passes = 3;
};

// Called after every frame: passes begun, and how much of this one is done (0..1; negative: not known).
using BenchProgress = std::function<void(std::size_t pass, double share)>;

// Measures until `passes` calm passes are there, twice as many at most. Throws InputError where the log or
// the configuration cannot be used.
[[nodiscard]] BenchReport run_bench(const BenchOptions& options, const daemon::Config& config,
                                    const BenchProgress& progress);

}  // namespace farpoint::tools
