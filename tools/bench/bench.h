// SPDX-License-Identifier: Apache-2.0
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

// Called after every frame with the passes begun and the share of this one done (0..1; negative: unknown).
using BenchProgress = std::function<void(std::size_t pass, double share)>;

// Measures until `passes` undisturbed passes exist, at most twice that number. Throws InputError for an
// unusable log or configuration.
[[nodiscard]] BenchReport run_bench(const BenchOptions& options, const daemon::Config& config,
                                    const BenchProgress& progress);

}  // namespace farpoint::tools
