// SPDX-License-Identifier: Apache-2.0
#include <spdlog/fmt/fmt.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "daemon/check/checks.h"
#include "daemon/system/boot_counter.h"

namespace farpoint::daemon {
namespace {

constexpr double kMega = 1e6, kMinute_s = 60.0;

std::string folder_of(const std::string& file) {
  const std::filesystem::path parent = std::filesystem::path(file).parent_path();
  return parent.empty() ? "." : parent.string();
}

// Why no file can be made in a folder; empty where it can.
std::string folder_problem(const std::string& folder) {
  struct stat status {};
  if (stat(folder.c_str(), &status) != 0)
    return fmt::format("folder {}: {}, expected a folder that this account may write to", folder,
                       std::strerror(errno));
  if (!S_ISDIR(status.st_mode)) return fmt::format("{}: no folder, expected one", folder);
  if (access(folder.c_str(), W_OK | X_OK) != 0)
    return fmt::format("folder {}: {}, expected one that this account may write to", folder,
                       std::strerror(errno));
  return {};
}

// Of this account; none: unknown.
std::optional<double> free_bytes(const std::string& folder) {
  struct statvfs disk {};
  if (statvfs(folder.c_str(), &disk) != 0) return {};
  return static_cast<double>(disk.f_bavail) * static_cast<double>(disk.f_frsize);
}

// Of raw images; 0: unknown.
double recorded_bytes_a_second(const Config& config, const std::optional<calibration_t>& calibration) {
  if (!calibration) return 0.0;
  double pixels = 0.0;
  for (const camera_calibration_t& camera : calibration->cameras)
    pixels += static_cast<double>(camera.width) * camera.height;
  return pixels * config.camera.rate_hz;
}

void check_room(const std::string& folder, const Config& config,
                const std::optional<calibration_t>& calibration, Findings* findings) {
  const std::optional<double> room = free_bytes(folder);
  const double rate = recorded_bytes_a_second(config, calibration);
  if (!room) return findings->ok("recording", folder + ": writable");
  const double limit_mb = config.record.max_size_mb;
  if (limit_mb > 0.0 && limit_mb * kMega > *room)
    return findings->warn(
        "recording", fmt::format("{}: {:.0f} MB free, expected the {:.0f} MB of record.max_size_mb", folder,
                                 *room / kMega, limit_mb));
  if (rate <= 0.0) return findings->ok("recording", fmt::format("{}: {:.0f} MB free", folder, *room / kMega));
  const std::string sentence = fmt::format("{}: {:.0f} MB free, {:.1f} min of images at {:.1f} MB a second",
                                           folder, *room / kMega, *room / rate / kMinute_s, rate / kMega);
  if (*room < rate * kMinute_s)
    findings->warn("recording", sentence + ", expected a minute at least");
  else
    findings->ok("recording", sentence);
}

void check_recording(const Options& options, const Config& config,
                     const std::optional<calibration_t>& calibration, Findings* findings) {
  if (options.record.empty()) return findings->ok("recording", "none is asked for (--record)");
  if (options.record == "-") return findings->ok("recording", "standard output");
  const std::string folder = folder_of(options.record);
  if (const std::string problem = folder_problem(folder); !problem.empty())
    return findings->fail("recording", problem);
  check_room(folder, config, calibration, findings);
}

void check_state(const std::string& key, Findings* findings) {
  const std::string folder = state_folder(key);
  if (key == "none")
    return findings->ok("state", "none is kept (state.folder): the boot counter is a random number");
  if (folder.empty())
    return findings->ok("state",
                        "the service's folder keeps the boot counter; in a run by hand it is a random "
                        "number (state.folder)");
  if (const std::string problem = folder_problem(folder); !problem.empty())
    return findings->warn("state", problem + "; the boot counter is a random number");
  findings->ok("state", folder + ": writable");
}

void check_file(const std::string& what, const std::string& path, Findings* findings) {
  if (path.empty() || path == "none" || path == "-") return;
  if (const std::string problem = folder_problem(folder_of(path)); !problem.empty())
    return findings->fail(what, problem);
  findings->ok(what, path + ": can be written");
}

// A run without it goes on, and the service makes the folder itself.
void check_commands(const std::string& socket, Findings* findings) {
  const std::string what = "commands";
  if (socket == "none") return findings->ok(what, "none (control.socket)");
  if (const std::string problem = folder_problem(folder_of(socket)); !problem.empty())
    return findings->warn(what, problem + "; the service's own folder is there while it runs");
  findings->ok(what, socket);
}

}  // namespace

void check_outputs(const Options& options, Findings* findings) {
  check_file("--output", options.output, findings);
  check_file("--trajectory", options.trajectory, findings);
  check_file("--live-trajectory", options.live_trajectory, findings);
  check_file("--can-log", options.can_log, findings);
}

void check_folders(const Options& options, const Config& config,
                   const std::optional<calibration_t>& calibration, Findings* findings) {
  check_recording(options, config, calibration, findings);
  check_state(config.state.folder, findings);
  check_file("log file", config.log.file, findings);
  check_outputs(options, findings);
  check_commands(config.control.socket, findings);
}

}  // namespace farpoint::daemon
