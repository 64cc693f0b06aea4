// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/config/build_info.h"
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

// "farpoint import bag": the program with the commands that were understood.
std::string understood(const CLI::App& app) {
  std::string words = app.get_name();
  for (const CLI::App* at = &app; !at->get_subcommands().empty();) {
    at = at->get_subcommands().front();
    words += " " + at->get_name();
  }
  return words;
}

// Help or the version was asked for: it goes to standard output. Anything else is wrong use.
int report_parse_error(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == 0) return app.exit(error);
  return report(std::string(error.what()) + " (see " + understood(app) + " --help)", kExitMisused);
}

// 'farpoint help COMMAND' is 'farpoint COMMAND --help'.
std::vector<const char*> with_help_last(int argc, const char* const* argv) {
  std::vector<const char*> words(argv, argv + argc);
  if (argc < 2 || std::string_view(argv[1]) != "help" || (argc > 2 && argv[2][0] == '-')) return words;
  words.erase(words.begin() + 1);
  words.push_back("--help");
  return words;
}

void add_help_command(CLI::App* app) {
  CLI::App* command =
      app->add_subcommand("help", "Explain a command, as its --help does: farpoint help import video");
  command->add_option_function<std::vector<std::string>>(
      "COMMAND", [](const std::vector<std::string>&) {}, "Command, and the layout of an import");
  command->footer("Example: farpoint help import bag");
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
std::string unknown_words(const CLI::App& app, const std::vector<const char*>& words) {
  const std::string first = words.size() > 1 ? words[1] : "", second = words.size() > 2 ? words[2] : "";
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
      "'farpoint COMMAND --help' and 'farpoint help COMMAND' explain a command.\n"
      "Exit status: 0 done, 1 failed while running (or an --expect broken), 2 wrong use or input.");
  app.set_version_flag("--version", "farpoint " + daemon::build_text());
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
  add_bugreport_command(&app, &action);
  add_help_command(&app);
  const std::vector<const char*> words = with_help_last(argc, argv);
  const std::string unknown = unknown_words(app, words);
  if (!unknown.empty()) return report(unknown, kExitMisused);
  try {
    app.parse(static_cast<int>(words.size()), words.data());
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
