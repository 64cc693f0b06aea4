// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <map>
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
  bool json = false, csv = false;
};

int print_figures(const std::vector<std::filesystem::path>& runs) {
  std::printf("%s\n", report::make_figures(runs).dump().c_str());
  return kExitDone;
}

// PAGE.RUN.csv beside PAGE.html; runs of the same name are numbered.
void write_tables(const std::string& output, const std::vector<report::Report::Table>& tables) {
  std::map<std::string, int> uses;
  for (const report::Report::Table& table : tables) {
    const int use = ++uses[table.run];
    std::filesystem::path file = output;
    file.replace_extension(table.run + (use > 1 ? "." + std::to_string(use) : "") + ".csv");
    write_file(file, table.csv);
    std::printf("%s: a row a frame of %s\n", file.c_str(), table.run.c_str());
  }
}

int run_report(const ReportOptions& options) {
  report::ReportRequest request;
  request.runs.assign(options.runs.begin(), options.runs.end());
  if (options.json) return print_figures(request.runs);
  if (options.output.empty()) throw InputError("report: expected -o FILE or --json, found neither");
  if (options.csv && options.output == "-")
    throw InputError("report: --csv writes beside the page, expected -o FILE instead of standard output");
  request.truth = options.truth;
  const report::Report made = report::make_report(request);
  write_file(options.output, made.page);
  std::printf("%s: report on %zu run%s, %.1f MB\n", options.output.c_str(), options.runs.size(),
              options.runs.size() == 1 ? "" : "s", 1e-6 * static_cast<double>(made.page.size()));
  if (options.csv) write_tables(options.output, made.tables);
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
      "The recording (LCM log), or a TUM file. With a recording the report shows tracks on its\n"
      "images, also without GROUND_TRUTH; with a simulated one, how right the landmarks are.\n"
      "Without it: no errors, each run in its own map frame");
  CLI::Option* output =
      command->add_option("-o,--output", options->output, "HTML file to write; an existing one is replaced");
  command
      ->add_flag("--json", options->json,
                 "Print figures instead, on one line: work (medians of features, matches, tracks, CPU ms),\n"
                 "frames (tracked, valid, dropped), memory (peak and pools, MB; after a tenth of\n"
                 "the frames, half, all)")
      ->excludes(truth)
      ->excludes(output);
  command->add_flag(
      "--csv", options->csv,
      "Also write a table a run beside the page, PAGE.RUN.csv: a row a frame with state, poses,\n"
      "velocity, truth, errors and times");
  command->footer(
      "The page needs no network. Its own script zooms by dragging and shows values under the pointer; "
      "without\n"
      "scripts the pictures are the same.\n"
      "Examples:\n"
      "  farpoint report run.lcm -o report.html\n"
      "  farpoint report run.lcm --truth recording.lcm -o report.html --csv\n"
      "  farpoint report kitti03.lcm town.lcm --json\n"
      "  farpoint report baseline.lcm vmp.lcm --truth town.lcm -o report.html");
  command->callback([=] { *action = [=] { return run_report(*options); }; });
}

}  // namespace farpoint::tools
