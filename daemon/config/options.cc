// SPDX-License-Identifier: Apache-2.0
#include "daemon/config/options.h"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <map>

#include "daemon/config/build_info.h"

namespace farpoint::daemon {
namespace {

constexpr double kMaxSpeed = 1000.0;

constexpr const char* kDescription =
    "farpointd: visual SLAM with distant landmarks.\n"
    "\n"
    "Tracks a camera against a map, and gives pose as LCM messages, odometry as CAN frames and trajectories "
    "as\n"
    "files. Without --replay it runs live, until SIGTERM: from the camera, to the network and the bus that "
    "the\n"
    "configuration names. With --replay camera data and calibration come from a recorded LCM log (made by\n"
    "'farpoint import', 'farpoint simulate', --record or lcm-logger), and nothing is sent that is not asked "
    "for.";

constexpr const char* kFooter =
    "Examples\n"
    "  farpointd --check\n"
    "  farpointd --check --replay run.lcm\n"
    "  farpointd --set camera.device=/dev/video0 --set camera.calibration=front.yaml --record run.lcm\n"
    "  farpoint import kitti /data/kitti 03 -o run.lcm\n"
    "  farpointd --replay run.lcm --lockstep --output out.lcm --trajectory final.tum --live-trajectory "
    "live.tum\n"
    "  farpointd --replay run.lcm --output live.lcm --trajectory final.tum\n"
    "  farpointd --replay run.lcm --schedule recorded --schedule-log live.lcm --output again.lcm\n"
    "  farpointd --replay run.lcm --lockstep --can-log out.candump --set scale.assumed=1\n"
    "  farpointd --replay run.lcm --lockstep --lcm-url 'udpm://239.255.76.67:7667?ttl=0'    (watch with "
    "lcm-spy)\n"
    "  farpoint evaluate out.lcm --truth run.lcm\n"
    "\n"
    "Exit status: 0 done (a run that was lost or never initialised is done; its last line states it);\n"
    "1 failed while running; 2 wrong use, configuration or input.";

struct Parsed {
  Options options;
  bool lockstep = false;
  std::string schedule;
};

void add_options(CLI::App* app, Parsed* parsed) {
  Options& o = parsed->options;
  app->add_option(
         "--config", o.config_path,
         "Configuration; else /etc/farpoint/farpoint.yaml where it exists, else built-in defaults (equal to "
         "config/farpoint.yaml, which explains every key)")
      ->type_name("FILE");
  app->add_option("--replay", o.replay, "LCM log to replay; '-' is standard input. Without: live")
      ->type_name("LOG");
  app->add_flag(
      "--check", o.check,
      "Look whether a live run, or with --replay that replay, would work here, print one line a thing (ok, "
      "warning, error) and leave: status 0, or 2 with an error. Sets nothing, writes nothing");
  app->add_flag("--json", o.json, "With --check: as JSON");
  app->add_flag(
      "--lockstep", parsed->lockstep,
      "One frame after the other, everything in one order: the same log and configuration give the same "
      "bytes, whatever the machine's load");
  app->add_option(
         "--speed", o.speed,
         "As on the vehicle: capture, tracking, mapping and output on threads of their own, images at "
         "X times the recorded pace. 1 where neither this, --lockstep nor --schedule is given")
      ->type_name("X");
  app->add_option("--schedule", parsed->schedule,
                  "Repeat a threaded run byte for byte, on one thread: the same frames dropped, the same map "
                  "views used. FARPOINT_SCHEDULE is taken from the replayed log, or from --schedule-log")
      ->type_name("recorded");
  app->add_option("--schedule-log", o.schedule_log,
                  "The threaded run's --output, where the replayed log does not hold FARPOINT_SCHEDULE")
      ->type_name("LOG");
  app->add_option(
         "--record", o.record,
         "Live: what the camera gave and its calibration, as a log that can be replayed. Raw images: 11 MB "
         "a second at 752x480 and 30 Hz")
      ->type_name("LOG");
  app->add_option("--output", o.output,
                  "Everything that is published, the final trajectory and a summary, as LCM log")
      ->type_name("LOG");
  app->add_option("--trajectory", o.trajectory,
                  "Final trajectory (TUM format, T_map_body) of the map with most frames; further maps go to "
                  "NAME.map2.tum and so on, frames whose map was never sound to NAME.unsound.tum")
      ->type_name("FILE");
  app->add_option("--live-trajectory", o.live_trajectory,
                  "Live trajectory: each frame's pose as it was published as valid")
      ->type_name("FILE");
  app->add_option("--can-log", o.can_log, "CAN frames as text, like 'candump -L' writes it")
      ->type_name("FILE");
  app->add_option("--lcm-url", o.lcm_url,
                  "Publish over the network too; without URL: lcm.url of the configuration")
      ->type_name("[URL]")
      ->expected(0, 1);
  app->add_option("--can", o.can_interface,
                  "Send on a SocketCAN interface too; without IFACE: can.interface of the configuration")
      ->type_name("[IFACE]")
      ->expected(0, 1);
  app->add_option("--set", o.settings, "Change one key of the configuration; may be repeated")
      ->type_name("dotted.key=value")
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

// True for NAME.map2.tum, NAME.unsound.tum, NAME.map2.unsound.tum, ... where the trajectory is NAME.tum.
bool is_further_map_of(const std::string& trajectory, const std::filesystem::path& path) {
  std::error_code ignored;
  const std::filesystem::path first =
      std::filesystem::weakly_canonical(std::filesystem::absolute(trajectory), ignored);
  const std::string start = first.stem().string() + ".map";
  std::string name = path.stem().string();
  const bool unsound = name.ends_with(".unsound");
  if (unsound) name = std::filesystem::path(name).stem().string();
  const bool further = name.starts_with(start) && name.size() > start.size() &&
                       name.find_first_not_of("0123456789", start.size()) == std::string::npos;
  return path.parent_path() == first.parent_path() && path.extension() == first.extension() &&
         (further || (unsound && name == first.stem().string()));
}

void check(const Parsed& parsed) {
  const Options& o = parsed.options;
  const bool replays = !o.replay.empty();
  if (!replays && (parsed.lockstep || o.speed || !parsed.schedule.empty() || !o.schedule_log.empty()))
    throw UsageError("--lockstep, --speed and --schedule are of a replay, expected --replay LOG with them");
  if (replays && !o.record.empty())
    throw UsageError("--record is of a live run, expected --replay or --record");
  if (!parsed.schedule.empty() && parsed.schedule != "recorded")
    throw UsageError("--schedule " + parsed.schedule + ": unknown, expected recorded");
  if (!o.schedule_log.empty() && parsed.schedule.empty())
    throw UsageError("--schedule-log without --schedule recorded, expected both");
  if (o.check && o.replay == "-") throw UsageError("--check --replay -: expected a log that is a file");
  if (o.json && !o.check) throw UsageError("--json without --check, expected both");
  if (parsed.lockstep && o.speed) throw UsageError("--lockstep and --speed exclude each other, expected one");
  if (o.speed && !(*o.speed > 0.0 && *o.speed <= kMaxSpeed))
    throw UsageError("--speed: expected a number above 0, at most 1000");
  // Two outputs in one file, or an output over the input, would destroy what the user wants to keep.
  std::map<std::filesystem::path, std::string> used;
  const auto claim = [&](const std::string& path, const std::string& name) {
    if (path.empty() || (name == "--replay" && path == "-")) return;
    std::error_code ignored;
    const std::filesystem::path real =
        std::filesystem::weakly_canonical(std::filesystem::absolute(path), ignored);
    const auto [before, first] = used.emplace(real, name);
    if (!first && !std::filesystem::is_character_file(real, ignored)) {
      throw UsageError(name + " " + path + ": the same file as " + before->second + ", expected another");
    }
  };
  claim(o.replay, "--replay");
  if (o.schedule_log != o.replay) claim(o.schedule_log, "--schedule-log");
  claim(o.record, "--record");
  claim(o.output, "--output");
  claim(o.trajectory, "--trajectory");
  claim(o.live_trajectory, "--live-trajectory");
  claim(o.can_log, "--can-log");
  // Further maps go beside the final trajectory: no other output may have their name.
  for (const auto& [path, name] : used) {
    if (!o.trajectory.empty() && is_further_map_of(o.trajectory, path)) {
      throw UsageError(name + " " + path.string() +
                       ": kept for a further map of --trajectory, expected another name");
    }
  }
}

}  // namespace

CommandLine parse_command_line(int argc, const char* const* argv) {
  CLI::App app(kDescription, "farpointd");
  app.footer(kFooter);
  app.set_version_flag("--version", std::string("farpointd ") + build_text());
  app.get_formatter()->column_width(34);
  Parsed parsed;
  add_options(&app, &parsed);
  CommandLine result;
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    result.text_and_leave = app.help();
    return result;
  } catch (const CLI::CallForVersion& version) {
    result.text_and_leave = std::string(version.what()) + "\n";
    return result;
  } catch (const CLI::ParseError& error) {
    throw UsageError(std::string(error.what()) + " (see --help)");
  }
  check(parsed);
  result.options = parsed.options;
  // A recording that is just replayed runs as on the vehicle.
  const bool has_order = parsed.lockstep || result.options.speed || !parsed.schedule.empty();
  if (!result.options.replay.empty() && !has_order) result.options.speed = 1.0;
  // The order is the recorded one then, whatever the pace.
  if (!parsed.schedule.empty()) {
    result.options.speed.reset();
    if (result.options.schedule_log.empty()) result.options.schedule_log = result.options.replay;
  }
  return result;
}

}  // namespace farpoint::daemon
