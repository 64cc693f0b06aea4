// SPDX-License-Identifier: Apache-2.0
// Evaluation as text: details of each run, then one table with one row a run.
#pragma once

#include <string>
#include <vector>

#include "tools/evaluate/run_metrics.h"

namespace farpoint::tools {

// Lines `NAME final: n=.. share=.. ...` and `NAME live: ...` and so on, one fact a key; without truth those
// that need none.
[[nodiscard]] std::string details_text(const RunMetrics& metrics);

// Two header lines and one row a run, in the given order; the last line is the last run's. Runs without truth
// have columns of their own.
[[nodiscard]] std::string table_text(const std::vector<RunMetrics>& runs);

}  // namespace farpoint::tools
