// SPDX-License-Identifier: Apache-2.0
#include "tools/report/report.h"

#include "tools/report/frame_table.h"
#include "tools/report/html.h"
#include "tools/report/sections.h"
#include "tools/report/svg.h"
#include "tools/report/upright.h"
#include "tools/report/work_figures.h"

namespace farpoint::tools::report {

namespace {

std::string truth_text(const ReportRequest& request, const Truth& truth) {
  if (request.truth.empty()) return "Without truth.";
  const std::string name = escaped(request.truth.filename().string());
  return truth.is_known() ? "Truth: " + name + "." : "Without truth: " + name + " has no GROUND_TRUTH.";
}

}  // namespace

Report make_report(const ReportRequest& request) {
  Truth truth = request.truth.empty() ? Truth{} : read_reference(request.truth, true);
  const std::string turned = turn_upright(&truth);
  const Truth* known = truth.is_known() ? &truth : nullptr;
  Runs runs;
  std::string names;
  for (const std::filesystem::path& file : request.runs) {
    runs.push_back(read_run_record(file, known));
    names += (names.empty() ? "" : ", ") + runs.back().name;
  }
  std::string body = "<p>" + truth_text(request, truth) + (turned.empty() ? "" : " " + turned) + "</p>\n";
  body += overview_section(runs) + trajectory_section(runs, known) + error_section(runs, known) +
          motion_section(runs, known) + landmark_section(runs) + vmp_section(runs) + map_section(runs) +
          track_section(runs, request.truth) + timing_section(runs) + workload_section(runs) +
          health_section(runs) + configuration_section(runs);
  Report report{page("Farpoint: " + names, body), {}};
  for (const RunRecord& run : runs) report.tables.push_back({run.name, frame_table(run, known)});
  return report;
}

Json make_figures(const std::vector<std::filesystem::path>& runs) {
  Json::Array items;
  for (const std::filesystem::path& file : runs) items.push_back(run_figures(read_run_record(file, nullptr)));
  Json json = Json::object();
  json.set("runs", items);
  return json;
}

}  // namespace farpoint::tools::report
