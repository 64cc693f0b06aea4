// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "daemon/config/config.h"
#include "ipc/can_dbc.h"
#include "tools/commands/commands.h"
#include "tools/common/errors.h"
#include "tools/common/text_file.h"

namespace farpoint::tools {
namespace {

constexpr const char* kSystemConfig = "/etc/farpoint/farpoint.yaml";

struct DbcOptions {
  std::string config, output = "-";
  std::vector<std::string> settings;
};

daemon::Config configuration_of(const DbcOptions& options) {
  daemon::Config config;
  daemon::ConfigOrigins origins;
  std::error_code ignored;
  const bool has_file = !options.config.empty() || std::filesystem::exists(kSystemConfig, ignored);
  if (has_file)
    daemon::load_config_file(options.config.empty() ? kSystemConfig : options.config, &config, &origins);
  for (const std::string& setting : options.settings) daemon::apply_setting(setting, &config, &origins);
  daemon::check_relations(config, origins);
  return config;
}

int run_dbc(const DbcOptions& options) {
  try {
    const ipc::CanLayout layout = daemon::can_layout(configuration_of(options).can);
    write_file(options.output, ipc::dbc_text(layout));
    constexpr double kUsualBus_bit_s = 500e3, kPercent = 100.0;
    if (options.output != "-" && !layout.fd) {
      std::printf("%s: at most %.1f %% of a bus of 500 kbit/s\n", options.output.c_str(),
                  kPercent * layout.worst_load(kUsualBus_bit_s));
    }
  } catch (const daemon::ConfigError& error) {
    throw InputError(error.what());
  }
  return kExitDone;
}

}  // namespace

void add_dbc_command(CLI::App* app, Action* action) {
  const auto options = std::make_shared<DbcOptions>();
  CLI::App* command =
      app->add_subcommand("dbc", "Write the DBC file of the CAN frames that a configuration asks for");
  command->add_option("--config", options->config,
                      "Configuration; else /etc/farpoint/farpoint.yaml where it exists, else the defaults");
  command->add_option("-o,--output", options->output, "File to write; '-' (the default) is standard output");
  command->add_option("--set", options->settings, "Change one key of the configuration; may be repeated")
      ->type_name("dotted.key=value")
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command->footer(
      "Identifiers, Data IDs, cycle times and CAN FD follow the keys of section can; config/farpoint.dbc is "
      "the\n"
      "file of the defaults.\n"
      "Examples:\n"
      "  farpoint dbc --config /etc/farpoint/farpoint.yaml -o mine.dbc\n"
      "  farpoint dbc --set can.fd=true --set can.base_id=256 -o fd.dbc");
  command->callback([=] { *action = [=] { return run_dbc(*options); }; });
}

}  // namespace farpoint::tools
