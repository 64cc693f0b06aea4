// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "ipc/printable.h"
#include "tools/commands/commands.h"
#include "tools/common/errors.h"

namespace farpoint::tools {
namespace {

// One line, whatever a library's message holds.
int report(const std::string& message, int status) {
  std::string line = message;
  while (!line.empty() && line.back() == '\n') line.pop_back();
  std::fprintf(stderr, "farpoint: %s\n", ipc::printable(line).c_str());
  return status;
}

// Help was asked for: it goes to standard output. Anything else is wrong use.
int report_parse_error(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == 0) return app.exit(error);
  return report(std::string(error.what()) + " (see farpoint --help)", kExitMisused);
}

// CLI11 would only say that a command is missing. Empty where the word is a command or an option. `kind` is
// what the words are, "command" or "import".
std::string unknown_command(const CLI::App& app, const std::string& word, const std::string& kind) {
  if (word.starts_with('-')) return {};
  std::string known;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (command->get_name() == word) return {};
    known += (known.empty() ? "" : ", ") + command->get_name();
  }
  return (word.empty() ? "no " + kind : "unknown " + kind + " '" + word + "'") +
         ", expected one of: " + known + " (see " + (kind == "command" ? "farpoint" : "farpoint " + kind) +
         " --help)";
}

// The same for the first word, and for the layout behind 'import'.
std::string unknown_words(const CLI::App& app, int argc, const char* const* argv) {
  const std::string first = argc > 1 ? argv[1] : "", second = argc > 2 ? argv[2] : "";
  std::string unknown = unknown_command(app, first, "command");
  if (!unknown.empty() || first != "import") return unknown;
  return unknown_command(*app.get_subcommand("import"), second, "import");
}

}  // namespace

int run_farpoint(int argc, const char* const* argv) {
  CLI::App app(
      "farpoint: bench tool of the Farpoint visual SLAM daemon.\n"
      "Brings recordings into LCM logs that farpointd replays, and says how good and how fast a run was.",
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
  add_dbc_command(&app, &action);
  add_evaluate_command(&app, &action);
  add_bench_command(&app, &action);
  add_ctl_command(&app, &action);
  add_top_command(&app, &action);
  add_spy_command(&app, &action);
  add_report_command(&app, &action);
  add_simulate_command(&app, &action);
  add_mask_command(&app, &action);
  const std::string unknown = unknown_words(app, argc, argv);
  if (!unknown.empty()) return report(unknown, kExitMisused);
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
