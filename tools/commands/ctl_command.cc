// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "daemon/system/control_socket.h"
#include "tools/commands/commands.h"
#include "tools/common/errors.h"

namespace farpoint::tools {
namespace {

struct CtlOptions {
  std::string socket = "/run/farpoint/control";
  std::string command;
};

int run_ctl(const CtlOptions& options) {
  std::string answer;
  try {
    answer = daemon::ask_daemon(options.socket, options.command);
  } catch (const std::runtime_error& error) {
    throw RunError(error.what());
  }
  if (!answer.starts_with("ok")) throw RunError(options.socket + ": " + answer);
  std::printf("%s\n", answer.c_str());
  return kExitDone;
}

}  // namespace

void add_ctl_command(CLI::App* app, Action* action) {
  auto options = std::make_shared<CtlOptions>();
  CLI::App* command = app->add_subcommand("ctl", "Commands to the running farpointd, on its local socket");
  command
      ->add_option("COMMAND", options->command,
                   "status: state and counts; reset-odom: the next pose becomes the origin of odom, and the "
                   "reset counter goes up; stop: end in order")
      ->required()
      ->check(CLI::IsMember({"status", "reset-odom", "stop"}));
  command->add_option("--socket", options->socket, "Key control.socket of the daemon's configuration")
      ->type_name("PATH")
      ->capture_default_str();
  command->footer(
      "Examples:\n"
      "  farpoint ctl status\n"
      "  farpoint ctl reset-odom\n"
      "Members of the group farpoint may use the socket. A daemon that systemd runs and that is stopped here "
      "stays\n"
      "stopped until it is started again.");
  command->callback([options, action] { *action = [options] { return run_ctl(*options); }; });
}

}  // namespace farpoint::tools
