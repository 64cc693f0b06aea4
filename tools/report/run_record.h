// SPDX-License-Identifier: Apache-2.0
// Content of one run's output log for a report, in order of time.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ipc/message.h"
#include "tools/evaluate/run_metrics.h"

namespace farpoint::tools::report {

// A frame as it was published.
struct PublishedFrame {
  double time_s = 0.0;
  std::int8_t state = 0;  // status_t.STATE_*
  bool valid = false;
  int features = 0, matches = 0, inliers = 0;
};

struct RunRecord {
  std::string name;
  Run run;
  std::optional<RunMetrics> metrics;  // where there is truth
  std::vector<PublishedFrame> frames;
  std::vector<timing_t> timings;
  std::vector<status_t> statuses;
  std::optional<map_t> map;  // the last one published
  double start_s = 0.0;      // of the first frame published

  [[nodiscard]] const landmarks_t* landmarks() const;
  [[nodiscard]] const summary_t* summary() const;
  // Metres a map unit by the alignment; 1 without truth.
  [[nodiscard]] double scale() const;
  // Map coordinates to the world's; identity without truth.
  [[nodiscard]] slam::Sim3 world_from_map() const;
  [[nodiscard]] std::string length_unit() const;
};

// Throws InputError unless the file is an output log of farpointd.
[[nodiscard]] RunRecord read_run_record(const std::filesystem::path& file, const Truth* truth);

}  // namespace farpoint::tools::report
