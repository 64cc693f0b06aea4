// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "tools/report/html.h"
#include "tools/report/sections.h"
#include "tools/report/svg.h"
#include "tools/report/work_figures.h"

namespace farpoint::tools::report {
namespace {

// Recordings whose figures lie within this factor of each other are work of the same kind.
constexpr double kAlikeFactor = 1.5;

std::string ratio_text(double ratio) {
  if (!std::isfinite(ratio)) return "-";
  const bool alike = ratio < kAlikeFactor && ratio > 1.0 / kAlikeFactor;
  return number(ratio, 2) + (alike ? "" : " !");
}

}  // namespace

std::string workload_section(const Runs& runs) {
  std::vector<std::vector<std::string>> rows = {{"median over the run"}};
  for (const RunRecord& run : runs) rows[0].push_back(run.name);
  for (std::size_t i = 1; i < runs.size(); ++i) rows[0].push_back(runs[i].name + " / " + runs[0].name);
  for (const WorkFigure& figure : work_figures()) {
    std::vector<std::string> row = {figure.name};
    std::vector<double> values;
    for (const RunRecord& run : runs) values.push_back(figure.value(run));
    // Threaded runs do not time the parts of tracking and mapping.
    if (std::none_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); })) continue;
    for (const double value : values) row.push_back(number(value, value < 10.0 ? 2 : 1));
    for (std::size_t i = 1; i < values.size(); ++i) row.push_back(ratio_text(values[i] / values[0]));
    rows.push_back(row);
  }
  return section("Work",
                 "What the images gave the estimator to do. Ratios beyond a factor of 1.5 are marked (!): a "
                 "simulated world's figures tell how far it stands in for a recorded drive.",
                 table(rows));
}

}  // namespace farpoint::tools::report
