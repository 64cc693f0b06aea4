// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "tools/bugreport/bugreport.h"
#include "tools/commands/commands.h"
#include "tools/common/errors.h"

namespace farpoint::tools {
namespace {

int run_bugreport(const BugreportOptions& options) {
  for (const std::string& line : make_bugreport(options)) std::printf("not read: %s\n", line.c_str());
  return kExitDone;
}

}  // namespace

void add_bugreport_command(CLI::App* app, Action* action) {
  const auto options = std::make_shared<BugreportOptions>();
  CLI::App* command = app->add_subcommand(
      "bugreport", "Collect configuration, versions, state, log and hardware in one archive");
  command
      ->add_option("--config", options->config,
                   "Configuration; else /etc/farpoint/farpoint.yaml where it exists, else the defaults")
      ->type_name("FILE");
  command
      ->add_option("--socket", options->socket,
                   "Of the running daemon; else control.socket of the configuration")
      ->type_name("PATH");
  command
      ->add_option("-o,--output", options->output,
                   "Archive to write; else farpoint-bugreport-DATE-TIME.tar.gz in this folder")
      ->type_name("FILE.tar.gz");
  command->footer(
      "Takes the configuration with calibration and wheel DBC file, 'farpointd --check', the daemon's "
      "status, the\n"
      "last 2000 lines of its journal, its log file, versions, processor, memory, video devices and CAN "
      "interfaces.\n"
      "No images, recordings or maps. contents.txt in the archive lists what was taken and what could not be "
      "read\n"
      "and why. Root is not needed; the journal needs root, or group adm.\n"
      "Example:\n"
      "  farpoint bugreport -o fault.tar.gz && tar -tf fault.tar.gz");
  command->callback([=] { *action = [=] { return run_bugreport(*options); }; });
}

}  // namespace farpoint::tools
