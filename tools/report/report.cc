// SPDX-License-Identifier: Apache-2.0
#include "tools/report/report.h"

#include "tools/report/html.h"
#include "tools/report/sections.h"
#include "tools/report/work_figures.h"

namespace farpoint::tools::report {

std::string make_report(const ReportRequest& request) {
  std::optional<Truth> truth;
  if (!request.truth.empty()) truth = read_truth(request.truth, true);
  Runs runs;
  std::string names;
  for (const std::filesystem::path& file : request.runs) {
    runs.push_back(read_run_record(file, truth ? &*truth : nullptr));
    names += (names.empty() ? "" : ", ") + runs.back().name;
  }
  const Truth* known = truth ? &*truth : nullptr;
  std::string body = "<p>" +
                     (request.truth.empty() ? std::string("Without truth.")
                                            : "Truth: " + request.truth.filename().string() + ".") +
                     "</p>\n";
  body += overview_section(runs) + trajectory_section(runs, known) + landmark_section(runs) +
          vmp_section(runs) + map_section(runs) + track_section(runs, request.truth) + timing_section(runs) +
          workload_section(runs) + health_section(runs) + configuration_section(runs);
  return page("Farpoint: " + names, body);
}

Json make_figures(const std::vector<std::filesystem::path>& runs) {
  Json::Array items;
  for (const std::filesystem::path& file : runs) items.push_back(run_figures(read_run_record(file, nullptr)));
  Json json = Json::object();
  json.set("runs", items);
  return json;
}

}  // namespace farpoint::tools::report
