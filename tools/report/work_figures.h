// SPDX-License-Identifier: Apache-2.0
// Figures of one run without truth: the work that its images gave the estimator, frames, memory.
#pragma once

#include <functional>
#include <vector>

#include "tools/common/json.h"
#include "tools/report/run_record.h"

namespace farpoint::tools::report {

struct WorkFigure {
  const char* key;   // in JSON
  const char* name;  // in the report
  // Median over the run; NaN where the run did not measure it.
  std::function<double(const RunRecord&)> value;
};
[[nodiscard]] std::vector<WorkFigure> work_figures();

// Every figure by name; absent ones are null. Dropped frames and missed deadlines are those of the last
// status, which comes about once a second.
[[nodiscard]] Json run_figures(const RunRecord& run);

}  // namespace farpoint::tools::report
