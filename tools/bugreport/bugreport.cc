// SPDX-License-Identifier: Apache-2.0
#include "tools/bugreport/bugreport.h"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <optional>

#include "daemon/config/build_info.h"
#include "daemon/config/config.h"
#include "daemon/system/control_socket.h"
#include "ipc/output_file.h"
#include "tools/common/child_process.h"
#include "tools/common/errors.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSystemConfig = "/etc/farpoint/farpoint.yaml";
constexpr const char* kArchiveFolder = "farpoint-bugreport";
constexpr const char* kLogLines = "2000";

// A folder that goes with the object.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "farpoint-bugreport-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr)
      throw RunError(name + ": cannot be made (" + std::strerror(errno) + ")");
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

std::string configuration_file(const BugreportOptions& options) {
  std::error_code ignored;
  if (!options.config.empty()) return options.config;
  return fs::exists(kSystemConfig, ignored) ? kSystemConfig : "";
}

// The one beside this program, which is of the same build; else whatever PATH has.
std::string daemon_program() {
  std::error_code error;
  const fs::path beside = fs::read_symlink("/proc/self/exe", error).parent_path() / "farpointd";
  return !error && fs::exists(beside, error) ? beside.string() : "farpointd";
}

std::string utc(const char* format) {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  std::array<char, 64> text{};
  return {text.data(), std::strftime(text.data(), text.size(), format, &parts)};
}

// --- the parts

void collect_versions(Collection* collection) {
  collection->add_text("versions/farpoint.txt", "this program", "farpoint " + daemon::build_text() + "\n");
  collection->add_output("versions/farpointd.txt", {daemon_program(), "--version"}, "farpoint");
  collection->add_output("versions/packages.txt",
                         {"dpkg-query", "--show", "farpoint", "liblcm*", "libcamera*", "libspdlog*",
                          "libyaml-cpp*", "systemd", "linux-image-*"},
                         "dpkg");
  collection->add_output("versions/kernel.txt", {"uname", "--all"}, "coreutils");
  collection->add_file("versions/system.txt", "/etc/os-release");
}

// A calibration of a Kalibr chain is FILE#NAME.
void collect_calibration(const std::string& name, const std::string& key, Collection* collection) {
  std::error_code ignored;
  const std::size_t chain = key.rfind('#');
  const bool is_chain = chain != std::string::npos && !fs::exists(key, ignored);
  const std::string file = is_chain ? key.substr(0, chain) : key;
  collection->add_file("configuration/" + name, file);
}

// The configuration in use, where it can be read.
std::optional<daemon::Config> collect_configuration(const BugreportOptions& options, Collection* collection) {
  const std::string file = configuration_file(options);
  if (!file.empty()) collection->add_file("configuration/farpoint.yaml", file);
  collection->add_output("configuration/unit.txt", {"systemctl", "cat", "farpointd.service"}, "systemd");
  daemon::Config config;
  try {
    daemon::ConfigOrigins origins;
    std::vector<std::string> warnings;
    if (!file.empty()) daemon::load_config_file(file, &config, &origins, &warnings);
    daemon::check_relations(config, origins);
  } catch (const daemon::ConfigError& error) {
    collection->add_missing("configuration/all_keys.yaml", error.what());
    return {};
  }
  collection->add_text("configuration/all_keys.yaml",
                       fmt::format("{} and defaults, hash {:016x}", file.empty() ? "no file" : file,
                                   daemon::config_hash(config)),
                       daemon::canonical_text(config));
  const daemon::CameraConfig& camera = config.camera;
  if (camera.calibration != "log") collect_calibration("camera.yaml", camera.calibration, collection);
  if (camera.has_second()) collect_calibration("camera_1.yaml", camera.second_calibration, collection);
  if (config.can.wheels_dbc != "none")
    collection->add_file("configuration/wheels.dbc", config.can.wheels_dbc);
  return config;
}

void collect_state(const BugreportOptions& options, const daemon::Config& config, Collection* collection) {
  std::vector<std::string> check = {daemon_program(), "--check"};
  if (const std::string file = configuration_file(options); !file.empty())
    check.insert(check.end(), {"--config", file});
  collection->add_output("state/check.txt", check, "farpoint");
  const std::string& socket = options.socket.empty() ? config.control.socket : options.socket;
  try {
    collection->add_text("state/daemon.txt", "status by " + socket,
                         daemon::ask_daemon(socket, "status") + "\n");
  } catch (const std::runtime_error& error) {
    collection->add_missing("state/daemon.txt", std::string("no daemon answers: ") + error.what());
  }
  collection->add_output("state/service.txt", {"systemctl", "show", "farpointd.service"}, "systemd");
}

void collect_log(const daemon::Config& config, Collection* collection) {
  collection->add_output(
      "log/journal.txt",
      {"journalctl", "--unit=farpointd", "--lines", kLogLines, "--no-pager", "--output=short-precise"},
      "systemd");
  if (config.log.file != "none") collection->add_file("log/farpointd.log", config.log.file);
}

std::string video_devices() {
  std::string text;
  std::error_code error;
  for (const auto& node : fs::directory_iterator("/sys/class/video4linux", error)) {
    std::error_code ignored;
    text += node.path().filename().string() + " is " + fs::canonical(node.path(), ignored).string() + "\n";
  }
  return text.empty() ? "no video devices\n" : text;
}

void collect_hardware(Collection* collection) {
  collection->add_output("hardware/processor.txt", {"lscpu"}, "util-linux");
  collection->add_file("hardware/memory.txt", "/proc/meminfo");
  collection->add_text("hardware/video.txt", "/sys/class/video4linux", video_devices());
  collection->add_output("hardware/video_names.txt", {"v4l2-ctl", "--list-devices"}, "v4l-utils");
  for (const char* kind : {"can", "vcan"})
    collection->add_output(fmt::format("hardware/{}.txt", kind),
                           {"ip", "-details", "-statistics", "link", "show", "type", kind}, "iproute2");
  collection->add_output("hardware/disks.txt", {"df", "--human-readable"}, "coreutils");
}

std::string head_of_list() {
  return "farpoint bugreport of " + utc("%Y-%m-%d %H:%M:%S") +
         " UTC\n\n"
         "No images, recordings, maps, keys or passwords are looked for. Each file is as its source is, or "
         "begins "
         "with\na line that counts what was left out before it.\n"
         "The files hold what was configured and logged: names of this computer and its accounts, paths, "
         "serial\n"
         "numbers in names of devices. Read them before you send them.\n";
}

void pack(const fs::path& folder, const std::string& archive) {
  ChildProcess tar({"tar", "--create", "--gzip", "--file", archive, "--owner=0", "--group=0", "--directory",
                    folder.string(), kArchiveFolder},
                   "tar");
  std::array<char, 4096> ignored{};
  while (tar.read(ignored) > 0) continue;
  if (tar.wait() != 0) throw RunError(archive + ": cannot be made: tar: " + tar.complaint());
}

}  // namespace

void collect(const BugreportOptions& options, Collection* collection) {
  collect_versions(collection);
  const std::optional<daemon::Config> config = collect_configuration(options, collection);
  collect_state(options, config.value_or(daemon::Config{}), collection);
  collect_log(config.value_or(daemon::Config{}), collection);
  collect_hardware(collection);
}

std::vector<std::string> make_bugreport(const BugreportOptions& options) {
  const std::string output =
      options.output.empty() ? utc("farpoint-bugreport-%Y%m%d-%H%M%S.tar.gz") : options.output;
  std::optional<ipc::ReplacedPath> archive;
  try {
    archive.emplace(output);
  } catch (const std::runtime_error& error) {
    throw InputError(error.what());
  }
  const TemporaryFolder scratch;
  Collection collection(scratch.path() / kArchiveFolder);
  collect(options, &collection);
  collection.write_list(head_of_list());
  pack(scratch.path(), archive->writable());
  archive->commit();
  std::printf("%s: %zu files and contents.txt, which lists them\n", output.c_str(), collection.taken());
  return collection.missing();
}

}  // namespace farpoint::tools
