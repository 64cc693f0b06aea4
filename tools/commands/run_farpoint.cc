#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "tools/commands/commands.h"
#include "tools/common/errors.h"

namespace farpoint::tools {
namespace {

// One line, whatever a library's message holds.
int report(const std::string& message, int status) {
  std::string line = message;
  while (!line.empty() && line.back() == '\n') line.pop_back();
  for (char& c : line) {
    if (c == '\n') c = ' ';
  }
  std::fprintf(stderr, "farpoint: %s\n", line.c_str());
  return status;
}

// Help was asked for: it goes to standard output. Anything else is wrong use.
int report_parse_error(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == 0) return app.exit(error);
  return report(std::string(error.what()) + " (see farpoint --help)", kExitMisused);
}

}  // namespace

int run_farpoint(int argc, const char* const* argv) {
  CLI::App app(
      "farpoint: bench tool of the Farpoint visual SLAM daemon.\n"
      "Brings recordings into LCM logs that farpointd replays, and says how good a run was.",
      "farpoint");
  app.require_subcommand(1);
  app.footer(
      "Example: from a public recording to a figure\n"
      "  farpoint import kitti /data/kitti 03 -o kitti03.lcm\n"
      "  farpointd --replay kitti03.lcm --lockstep --output run.lcm --trajectory final.tum\n"
      "  farpoint evaluate run.lcm --truth kitti03.lcm\n"
      "'farpoint COMMAND --help' explains a command.\n"
      "Exit status: 0 done, 1 failed while running (or an --expect broken), 2 wrong use or input.");
  Action action;
  add_import_command(&app, &action);
  add_export_command(&app, &action);
  add_evaluate_command(&app, &action);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return report_parse_error(app, e);
  }
  try {
    return action();
  } catch (const InputError& e) {
    return report(e.what(), kExitMisused);
  } catch (const std::exception& e) {
    return report(e.what(), kExitFailed);
  }
}

}  // namespace farpoint::tools
