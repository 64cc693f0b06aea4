// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>

#include "ipc/channels.h"
#include "tools/commands/commands.h"
#include "tools/common/errors.h"
#include "tools/spy/spy_command_line.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

struct SpyOptions {
  std::string url = ipc::kDefaultLcmUrl;
  std::string jar;
};

// Becomes lcm-spy; returns only where that fails.
[[noreturn]] void become(std::vector<std::string> command_line) {
  std::vector<char*> arguments;
  arguments.reserve(command_line.size() + 1);
  for (std::string& argument : command_line) arguments.push_back(argument.data());
  arguments.push_back(nullptr);
  execv(arguments.front(), arguments.data());
  throw RunError("spy: " + command_line.front() + " cannot be started: " + std::strerror(errno));
}

int run_spy(const SpyOptions& options) {
  if (!options.jar.empty() && !fs::is_regular_file(options.jar))
    throw InputError("spy: --jar " + options.jar + ": no such file, expected a jar of LCM types");
  SpyParts parts =
      find_spy_parts(fs::read_symlink("/proc/self/exe"), {"/usr/share/java", "/usr/local/share/java"});
  if (!options.jar.empty()) parts.types_jar = fs::absolute(options.jar);
  become(spy_command_line(parts, options.url));
}

}  // namespace

void add_spy_command(CLI::App* app, Action* action) {
  auto options = std::make_shared<SpyOptions>();
  CLI::App* command =
      app->add_subcommand("spy", "lcm-spy with Farpoint's types: every message, field by field");
  command->add_option("--url", options->url, "Where it listens (key lcm.url)")
      ->type_name("URL")
      ->capture_default_str();
  command->add_option("--jar", options->jar, "Types instead of Farpoint's own")->type_name("FILE");
  command->footer(
      "Examples:\n"
      "  farpoint spy\n"
      "  farpoint spy --url 'udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304'     (for images)\n"
      "  farpoint spy --jar mine.jar\n"
      "Needs a display, a Java runtime and LCM's Java library: tools/deps --spy installs the last two.");
  command->callback([options, action] { *action = [options] { return run_spy(*options); }; });
}

}  // namespace farpoint::tools
