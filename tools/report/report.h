// SPDX-License-Identifier: Apache-2.0
// A report on runs as one HTML file that needs nothing else: no network, no script but its own.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/common/json.h"

namespace farpoint::tools::report {

struct ReportRequest {
  std::vector<std::filesystem::path> runs;  // output logs of farpointd
  std::filesystem::path truth;              // the recording, or a TUM file; may be empty
};

struct Report {
  struct Table {
    std::string run;  // its name
    std::string csv;
  };
  std::string page;
  std::vector<Table> tables;  // one a run: a row a frame (frame_table.h)
};

// A recording without GROUND_TRUTH gives its images only. Throws InputError for a file that cannot be read.
[[nodiscard]] Report make_report(const ReportRequest& request);

// Figures of runs without truth, for machines: {"runs": [{"name", "work", "frames", "memory"}]}. Throws
// InputError for a file that cannot be read.
[[nodiscard]] Json make_figures(const std::vector<std::filesystem::path>& runs);

}  // namespace farpoint::tools::report
