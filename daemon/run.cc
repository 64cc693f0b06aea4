// SPDX-License-Identifier: Apache-2.0
#include "daemon/run.h"

#include <spdlog/spdlog.h>

#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "daemon/check/check.h"
#include "daemon/config/config.h"
#include "daemon/config/options.h"
#include "daemon/config/rig.h"
#include "daemon/live.h"
#include "daemon/replay.h"
#include "daemon/system/logging.h"
#include "daemon/system/service_log.h"
#include "daemon/system/solver_loader.h"
#include "ipc/printable.h"

namespace farpoint::daemon {
namespace {

constexpr const char* kSystemConfig = "/etc/farpoint/farpoint.yaml";
constexpr int kFailed = 1, kWrongUse = 2;

// Path of the configuration; empty: built-in defaults.
std::string configuration_file(const Options& options) {
  std::error_code ignored;
  if (options.config_path) return *options.config_path;
  return std::filesystem::exists(kSystemConfig, ignored) ? kSystemConfig : "";
}

// *warnings: about a kept file.
Config load_configuration(const Options& options, std::vector<std::string>* warnings) {
  Config config;
  ConfigOrigins origins;
  if (const std::string file = configuration_file(options); !file.empty())
    load_config_file(file, &config, &origins, warnings);
  for (const std::string& setting : options.settings) apply_setting(setting, &config, &origins);
  check_relations(config, origins);
  return config;
}

void warn(const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) spdlog::warn("configuration: {}", warning);
}

// While the daemon runs.
Config read_configuration(const Options& options) {
  std::vector<std::string> warnings;
  Config config = load_configuration(options, &warnings);
  warn(warnings);
  return config;
}

// However the run ends, what it logged is written.
struct ServiceLogEnd {
  ServiceLogEnd() = default;
  ~ServiceLogEnd() { stop_service_log(); }
  ServiceLogEnd(const ServiceLogEnd&) = delete;
  ServiceLogEnd& operator=(const ServiceLogEnd&) = delete;
};

int fail(const char* what, int status) {
  std::fprintf(stderr, "farpointd: %s\n", ipc::printable(what).c_str());
  return status;
}

int check_only(const Options& options) {
  const std::string file = configuration_file(options);
  const std::string set = options.settings.empty() ? "" : ", with --set";
  return check(
      options, (file.empty() ? "built-in defaults" : file) + set,
      [&options](std::vector<std::string>* warnings) { return load_configuration(options, warnings); });
}

int run_checked(int argc, const char* const* argv) {
  const CommandLine line = parse_command_line(argc, argv);
  if (!line.text_and_leave.empty()) {
    std::fputs(line.text_and_leave.c_str(), stdout);
    return 0;
  }
  if (line.options.check) return check_only(line.options);
  std::vector<std::string> warnings;
  Config config = load_configuration(line.options, &warnings);
  load_solver(ceres_module_path(), &config.estimator.mapping);
  start_logging(config.log.level);
  if (line.options.replay.empty()) {
    start_service_log(config.log);
    const ServiceLogEnd end;
    warn(warnings);
    return live(line.options, config, [&line] { return read_configuration(line.options); });
  }
  warn(warnings);
  return replay(line.options, config);
}

}  // namespace

int run(int argc, const char* const* argv) {
  try {
    return run_checked(argc, argv);
  } catch (const UsageError& error) {
    return fail(error.what(), kWrongUse);
  } catch (const ConfigError& error) {
    return fail(error.what(), kWrongUse);
  } catch (const InputError& error) {
    return fail(error.what(), kWrongUse);
  } catch (const std::exception& error) {
    return fail(error.what(), kFailed);
  }
}

}  // namespace farpoint::daemon
