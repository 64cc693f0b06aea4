// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "tools/commands/commands.h"
#include "tools/common/errors.h"
#include "tools/common/text_file.h"
#include "tools/report/report.h"

namespace farpoint::tools {
namespace {

struct ReportOptions {
  std::vector<std::string> runs;
  std::string truth, output;
  bool json = false;
};

int print_figures(const std::vector<std::filesystem::path>& runs) {
  std::printf("%s\n", report::make_figures(runs).dump().c_str());
  return kExitDone;
}

int run_report(const ReportOptions& options) {
  report::ReportRequest request;
  request.runs.assign(options.runs.begin(), options.runs.end());
  if (options.json) return print_figures(request.runs);
  if (options.output.empty()) throw InputError("report: expected -o FILE or --json, found neither");
  request.truth = options.truth;
  const std::string page = report::make_report(request);
  write_file(options.output, page);
  std::printf("%s: report on %zu run%s, %.1f MB\n", options.output.c_str(), options.runs.size(),
              options.runs.size() == 1 ? "" : "s", 1e-6 * static_cast<double>(page.size()));
  return kExitDone;
}

}  // namespace

void add_report_command(CLI::App* app, Action* action) {
  const auto options = std::make_shared<ReportOptions>();
  CLI::App* command =
      app->add_subcommand("report", "Draw runs side by side, as one self-contained HTML file");
  command->add_option("RUN", options->runs, "Output logs of farpointd (--output)")->required();
  CLI::Option* truth = command->add_option(
      "--truth", options->truth,
      "The recording (LCM log with GROUND_TRUTH), or a TUM file. With a recording the report\n"
      "shows tracks on its images; with a simulated one, how right the landmarks are");
  CLI::Option* output =
      command->add_option("-o,--output", options->output, "HTML file to write; an existing one is replaced");
  command
      ->add_flag("--json", options->json,
                 "Print figures instead, on one line: work (medians of features, matches, tracks, CPU ms),\n"
                 "frames (tracked, valid, dropped), memory (peak and pools, MB; after a tenth of\n"
                 "the frames, half, all)")
      ->excludes(truth)
      ->excludes(output);
  command->footer(
      "Examples:\n"
      "  farpoint report run.lcm -o report.html\n"
      "  farpoint report kitti03.lcm town.lcm --json\n"
      "  farpoint report baseline.lcm vmp.lcm --truth town.lcm -o report.html");
  command->callback([=] { *action = [=] { return run_report(*options); }; });
}

}  // namespace farpoint::tools
