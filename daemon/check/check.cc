// SPDX-License-Identifier: Apache-2.0
#include "daemon/check/check.h"

#include <spdlog/fmt/fmt.h>

#include <cstdio>
#include <stdexcept>

#include "daemon/check/checks.h"
#include "daemon/config/build_info.h"
#include "daemon/system/solver_loader.h"

namespace farpoint::daemon {
namespace {

constexpr const char* kConfiguration = "configuration";
constexpr int kDone = 0, kWrong = 2;

void check_solver(const Config& config, Findings* findings) {
  slam::MappingConfig mapping = config.estimator.mapping;
  try {
    load_solver(ceres_module_path(), &mapping);
    findings->ok("solver", value_text(config, "mapping.solver"));
  } catch (const std::runtime_error& error) {
    findings->fail("solver", error.what());
  }
}

// Only what was asked for leaves a replay, and no thread of it has a deadline.
void check_replay(const Options& options, const Config& config, Findings* findings) {
  const std::optional<calibration_t> calibration = check_log(options.replay, config, findings);
  if (calibration) check_masks(config, *calibration, findings);
  if (options.lcm_url) check_network(options, config, findings);
  if (options.can_interface) check_bus(options, config, findings);
  check_outputs(options, findings);
}

void check_live(const Options& options, const Config& config, Findings* findings) {
  const std::optional<calibration_t> calibration = check_calibration(config, findings);
  if (calibration) {
    check_masks(config, *calibration, findings);
    check_cameras(config, *calibration, "", findings);
  } else {
    findings->warn("camera", "not looked at: its calibration cannot be used");
  }
  check_network(options, config, findings);
  check_bus(options, config, findings);
  check_privileges(config.realtime, read_privileges(), usable_cores(), "", findings);
  check_clocks(read_clocks(), findings);
  check_folders(options, config, calibration, findings);
}

void check_configured(const Options& options, const Config& config, Findings* findings) {
  check_solver(config, findings);
  if (options.replay.empty())
    check_live(options, config, findings);
  else
    check_replay(options, config, findings);
}

}  // namespace

Findings check_everything(const Options& options, const std::string& configuration,
                          const ReadConfiguration& read) {
  Findings findings;
  std::vector<std::string> warnings;
  try {
    const Config config = read(&warnings);
    (void)can_layout(config.can);
    for (const std::string& warning : warnings) findings.warn(kConfiguration, warning);
    findings.ok(kConfiguration, fmt::format("{}, hash {:016x}", configuration, config_hash(config)));
    check_configured(options, config, &findings);
  } catch (const ConfigError& error) {
    findings.fail(kConfiguration, error.what());
  }
  return findings;
}

int check(const Options& options, const std::string& configuration, const ReadConfiguration& read) {
  const Findings findings = check_everything(options, configuration, read);
  const std::string text = options.json ? findings.json("farpointd " + build_text()) : findings.text();
  std::fputs(text.c_str(), stdout);
  return findings.worst() == Verdict::kError ? kWrong : kDone;
}

}  // namespace farpoint::daemon
