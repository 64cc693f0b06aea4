// SPDX-License-Identifier: Apache-2.0
// A run's frames as CSV, for other programs: one row a published frame.
#pragma once

#include <string>

#include "tools/report/run_record.h"

namespace farpoint::tools::report {

// Columns by their names in the first row. Lengths are metres by the alignment where there is truth, else the
// run's own, which `length_unit` names. Cells without a figure are empty. `truth`: null without one.
[[nodiscard]] std::string frame_table(const RunRecord& run, const Truth* truth);

}  // namespace farpoint::tools::report
