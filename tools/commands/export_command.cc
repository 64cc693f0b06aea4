// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "tools/commands/commands.h"
#include "tools/common/errors.h"
#include "tools/common/text_file.h"
#include "tools/evaluate/log_input.h"

namespace farpoint::tools {
namespace {

struct ExportOptions {
  std::string log, output = "-";
  bool truth = false;
  std::string trajectory;  // "", final, live
  std::string point = "body";
  std::string origin = "world";
};

Trajectory truth_of(const ExportOptions& options) {
  RecordingLog log = read_recording_log(options.log);
  if (log.truth.poses.empty()) {
    throw InputError(options.log + ": no GROUND_TRUTH messages, expected a recording with truth");
  }
  if (options.point == "camera0") {
    if (!log.calibration)
      throw InputError(options.log + ": no CALIBRATION message, --point camera0 needs one");
    const Eigen::Vector3d lever_arm = log.T_body_camera0().t;
    if (!log.truth.has_orientation && !lever_arm.isZero()) {
      throw InputError(options.log + ": truth of position only, --point camera0 needs its orientation");
    }
    move_reference_point({Eigen::Quaterniond::Identity(), lever_arm}, &log.truth);
  }
  return std::move(log.truth);
}

Trajectory trajectory_of(const ExportOptions& options) {
  RunLog log = read_run_log(options.log);
  if (options.trajectory == "final") {
    if (!log.has_trajectory)
      throw InputError(options.log + ": no FARPOINT_TRAJECTORY message, did farpointd end in order?");
    return std::move(log.final_trajectory);
  }
  return std::move(log.live_trajectory);
}

int run_export(const ExportOptions& options) {
  if (options.truth == !options.trajectory.empty()) {
    throw InputError("export: expected either --truth or --trajectory final|live");
  }
  Trajectory trajectory = options.truth ? truth_of(options) : trajectory_of(options);
  if (options.origin == "first" && !trajectory.poses.empty()) {
    if (!trajectory.has_orientation)
      throw InputError("--origin first: the truth has positions only, expected orientation too");
    start_at_origin(&trajectory);
  }
  write_file(options.output, to_tum(trajectory));
  if (options.output != "-") std::printf("%s: %zu poses\n", options.output.c_str(), trajectory.poses.size());
  return kExitDone;
}

}  // namespace

void add_export_command(CLI::App* app, Action* action) {
  const auto options = std::make_shared<ExportOptions>();
  CLI::App* command = app->add_subcommand("export", "Write the truth or a trajectory of a log as a TUM file");
  command
      ->add_option("LOG", options->log,
                   "Recording (for --truth) or output log of farpointd (for --trajectory)")
      ->required();
  command->add_flag("--truth", options->truth, "The recording's truth: T_world_body");
  command
      ->add_option("--trajectory", options->trajectory,
                   "final: after the last optimisation; live: as published")
      ->check(CLI::IsMember({"final", "live"}));
  command->add_option("-o,--output", options->output, "File to write; '-' (the default) is standard output");
  command
      ->add_option(
          "--point", options->point,
          "With --truth: the point that is followed. camera0: its position, with the body's axes, where a\n"
          "run of unknown scale has its body")
      ->check(CLI::IsMember({"body", "camera0"}));
  command
      ->add_option(
          "--origin", options->origin,
          "world: the data set's own world. first: the first pose becomes the origin, as for T_map_body")
      ->check(CLI::IsMember({"world", "first"}));
  command->footer(
      "TUM format: 'seconds tx ty tz qx qy qz qw' of the body, seconds with 6 decimals; truth of position "
      "only has\n"
      "the quaternion 0 0 0 1.\n"
      "Examples:\n"
      "  farpoint export kitti03.lcm --truth -o truth.tum\n"
      "  farpoint export mh01.lcm --truth --point camera0 -o truth_camera0.tum\n"
      "  farpoint export run.lcm --trajectory live -o live.tum");
  command->callback([=] { *action = [=] { return run_export(*options); }; });
}

}  // namespace farpoint::tools
