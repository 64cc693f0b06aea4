// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/bench/bench.h"
#include "tools/commands/commands.h"
#include "tools/common/errors.h"
#include "tools/common/progress.h"

namespace farpoint::tools {
namespace {

struct BenchCommandOptions {
  BenchOptions bench;
  std::string config_file;
  std::vector<std::string> settings;
  bool json = false;
};

daemon::Config load_configuration(const BenchCommandOptions& options) {
  try {
    daemon::Config config;
    daemon::ConfigOrigins origins;
    if (!options.config_file.empty()) daemon::load_config_file(options.config_file, &config, &origins);
    for (const std::string& setting : options.settings) daemon::apply_setting(setting, &config, &origins);
    daemon::check_relations(config, origins);
    return config;
  } catch (const daemon::ConfigError& error) {
    throw InputError(error.what());
  }
}

// One bar a pass, since the number of passes is open.
class PassProgress {
 public:
  void advance(std::size_t pass, double share) {
    if (pass != pass_) bar_.emplace("pass " + std::to_string(pass), std::size_t{kSteps});
    pass_ = pass;
    if (share >= 0.0) bar_->advance(static_cast<std::size_t>(share * kSteps));
  }

 private:
  static constexpr int kSteps = 1000;
  std::size_t pass_ = 0;
  std::optional<Progress> bar_;
};

int run_bench_command(const BenchCommandOptions& options) {
  if (options.bench.log == "-")
    throw InputError("bench: the log is read several times, expected a file, found standard input");
  const daemon::Config config = load_configuration(options);
  BenchReport report;
  {
    PassProgress progress;
    report = run_bench(options.bench, config,
                       [&](std::size_t pass, double share) { progress.advance(pass, share); });
  }
  if (report.disturbance > kDisturbed) {
    std::fprintf(
        stderr,
        "farpoint: the machine was busy: the yardstick ran up to %.2f times its least in %zu passes, "
        "expected at most %.2f; the calmest %zu are shown\n",
        report.disturbance, report.passes_run, kDisturbed, report.passes);
  }
  if (options.json)
    std::printf("%s\n", to_json(report).dump().c_str());
  else
    std::printf("%s", to_text(report).c_str());
  return kExitDone;
}

}  // namespace

void add_bench_command(CLI::App* app, Action* action) {
  const auto options = std::make_shared<BenchCommandOptions>();
  CLI::App* command = app->add_subcommand("bench", "Say how long each stage takes, beside a yardstick");
  command->add_option("LOG", options->bench.log, "Recording: an LCM log as farpointd replays it")->required();
  command
      ->add_option("--passes", options->bench.passes,
                   "Runs over the recording that are pooled (default 3); disturbed ones are repeated, up to\n"
                   "twice as many in all")
      ->check(CLI::Range(1, 100));
  command->add_option("--config", options->config_file,
                      "Configuration, as for farpointd; default: the built-in one");
  command
      ->add_option("--set", options->settings, "dotted.key=value: one key of the configuration, repeatable")
      ->expected(1)
      ->take_all();
  command->add_flag("--json", options->json, "Machine-readable, on one line");
  command->footer(
      "Runs the estimator over the recording in lockstep, and after each frame the yardstick: cv::ORB with "
      "2000\n"
      "features on one thread, as ORB-SLAM3 uses for KITTI. What one machine does in 5 ms takes another 10, "
      "and twice\n"
      "as long beside other work; in yardsticks (a time over the yardstick's p50 of the same run) both say "
      "the same.\n"
      "  tracking       decoded grey image to pose: pyramid, extraction, matching, alignment, pose, keyframe "
      "decision\n"
      "                 and hand-over; every frame tracked against a map counts, those that became keyframes "
      "too\n"
      "  mapping        all that a keyframe costs beside tracking: triangulation, fusing, local_ba, "
      "calibration,\n"
      "                 culling, views\n"
      "  ..._wall       elapsed time; all others are CPU time of the thread\n"
      "  process CPU    decoding, tracking and mapping, over all frames\n"
      "  disturbance    how much slower the yardstick ran than it can: 90th percentile over the frames of "
      "its time\n"
      "                 against its least on that frame in any pass. A pass above 1.25 is repeated.\n"
      "--json: "
      "{\"yardstick_ms\":{\"p50\",\"p99\"},\"stages\":{\"tracking\":{\"p50_ms\",\"p99_ms\",\"max_ms\","
      "\"p50_yardsticks\",\n"
      "\"p99_yardsticks\"},...},\"process_cpu_yardsticks\",\"frames\"}; frames of all pooled passes.\n"
      "Examples:\n"
      "  farpoint bench kitti03.lcm\n"
      "  farpoint bench kitti03.lcm --set landmarks.mode=baseline --json");
  command->callback([=] { *action = [=] { return run_bench_command(*options); }; });
}

}  // namespace farpoint::tools
