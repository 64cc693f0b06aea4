// SPDX-License-Identifier: Apache-2.0
// The daemon's configuration: farpoint.yaml and --set, checked key by key.
//
// One table (config_keys()) holds every key: name, type, unit, range, and the field it fills. Parsing,
// checks, canonical text and hash use it, and a test compares config/farpoint.yaml with it. A new key is one
// line in config_keys.cc and one entry in config/farpoint.yaml.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "ipc/can_layout.h"
#include "ipc/channels.h"
#include "slam/config.h"

namespace farpoint::daemon {

struct LogConfig {
  std::string level = "info";
  // Live.
  std::string file = "none";
  int file_mb = 10, files = 5;
};

struct ControlConfig {
  std::string socket = "/run/farpoint/control";
};

// --record; 0: no limit.
struct RecordConfig {
  int max_size_mb = 0;
  double max_minutes = 0;
  double min_free_share = 0;  // of the disk
  int waiting_images = 60;    // of each camera, in memory
};

enum class CameraDriverChoice { kV4l2, kLibcamera, kFile, kLcm };
enum class CameraFormatChoice { kAuto, kGrey, kNv12, kYuyv, kRgb24, kMjpeg };
// Which cameras of a log the estimator uses.
enum class CameraUse { kAll, kOne };
enum class StampPointChoice { kAuto, kStartOfExposure, kStartOfReadout, kEndOfFrame };
enum class ExposureChoice { kCamera, kAuto, kManual };

struct ExposureConfig {
  ExposureChoice mode = ExposureChoice::kAuto;
  double manual_us = 5000;
  int manual_gain = 0;
  double short_us = 4000, max_us = 15000;
  double max_gain_share = 0.75;
  double target_grey = 110;
};

struct CameraConfig {
  int index = 0;  // the tracked camera, in the log and its calibration
  CameraUse use = CameraUse::kAll;
  // Live.
  CameraDriverChoice driver = CameraDriverChoice::kV4l2;
  std::string device = "/dev/video0";
  std::string calibration = "/etc/farpoint/camera.yaml";
  std::string second_device = "none";
  std::string second_calibration = "/etc/farpoint/camera_1.yaml";
  int pair_tolerance_us = 5000;
  std::string mask = "none", second_mask = "none";  // of camera 0 and camera 1; in replay too
  CameraFormatChoice format = CameraFormatChoice::kAuto;
  double rate_hz = 30;
  int buffers = 4;
  StampPointChoice stamp = StampPointChoice::kAuto;
  int time_offset_us = 0;
  double stall_s = 1.0;        // silence after which the stream restarts
  double open_limit_s = 30;    // of one opening or closing; longer is a hang
  double lost_after_s = 0.25;  // silence after which the state is 'no_camera'
  ExposureConfig exposure;

  [[nodiscard]] bool has_second() const { return second_device != "none"; }
};

struct ScaleConfig {
  double assumed = 0.0;  // metres a map unit; 0: unknown
};

// State kept over restarts.
struct StateConfig {
  std::string folder = "auto";  // auto: the service's, none where there is none
};

struct LcmConfig {
  bool enabled = true;  // live
  std::string url = ipc::kDefaultLcmUrl;
  double status_rate_hz = 5.0;
  double map_rate_hz = 1.0;
  int map_points = 2000;
};

enum class CanPoseFrame { kMap, kOdom };

struct CanConfig {
  bool enabled = false;  // live
  std::string interface = "can0";
  CanPoseFrame frame = CanPoseFrame::kOdom;
  bool fd = false;
  double rate_hz = 50;  // epochs a second
  int base_id = 0x680;
  bool extended_ids = false;
  int base_data_id = 0x4660;
  std::string messages = "status position_xy position_z attitude velocity sigmas/5 diagnosis/5";
  std::string wheels_dbc = "none", wheel_signals = "none";
};

// Odometry for an autopilot, live.
struct MavlinkConfig {
  bool enabled = false;
  std::string link = "udp:127.0.0.1:14580";  // udp:ADDRESS:PORT or serial:DEVICE:BAUD
  double rate_hz = 30;                       // ODOMETRY messages a second
  int system_id = 1, component_id = 197;
};

enum class SchedulingPolicy { kFifo, kRoundRobin };

// What the threads ask for where the configuration leaves it open (daemon/system/core_plan.h).
enum class RealtimeProfile { kDesk, kVehicle };

struct ThreadConfig {
  static constexpr int kByProfile = -1;
  int priority = kByProfile;  // 0: ordinary scheduling
  int core = kByProfile;
};

// Threaded runs.
struct RealtimeConfig {
  bool lock_memory = true;
  int stack_kb = 512;           // of each thread
  int capture_queue = 2;        // images that wait for tracking at most
  double least_features = 0.5;  // share of extractor.features, while tracking does not keep pace
  RealtimeProfile profile = RealtimeProfile::kDesk;
  SchedulingPolicy policy = SchedulingPolicy::kFifo;
  ThreadConfig capture, tracking, output, mapping;
  double deadline_ms = 0;   // mid-exposure to output; 0: live a frame period, in replay none
  int cpu_latency_us = -1;  // live; -1: unchanged
  bool require = false;     // exit if the system refuses one of these
  int disk_ring_mb = 8;     // what may wait for a slow disk
};

// Live: longest time without progress of a thread that has work, before the watchdog is no longer fed.
struct WatchdogConfig {
  double capture_s = 0.5, tracking_s = 0.5, mapping_s = 2.0, output_s = 0.5;
};

struct Config {
  int image_mb = 160;  // capacity.image_mb: of the images in memory; a larger image is refused
  LogConfig log;
  ControlConfig control;
  StateConfig state;
  RecordConfig record;
  CameraConfig camera;
  ScaleConfig scale;
  LcmConfig lcm;
  CanConfig can;
  MavlinkConfig mavlink;
  RealtimeConfig realtime;
  WatchdogConfig watchdog;
  slam::EstimatorConfig estimator;
};

// A user's error: what() is one line with place, key, value and what was expected.
class ConfigError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class KeyType { kInteger, kNumber, kText, kChoice };

// One key of the configuration.
struct ConfigKey {
  std::string name;  // dotted: section.key
  KeyType type = KeyType::kInteger;
  std::string unit;             // "px", "frames", ...; empty where the value has none
  double min = 0.0, max = 0.0;  // inclusive; numbers only
  std::vector<std::string> choices;
  // Canonical text of the value: a number's shortest form that reads back to the same bits.
  std::function<std::string(const Config&)> get;
  // Stores a checked value; text of numbers parses.
  std::function<void(Config&, const std::string&)> set;
};

// All keys in the order of config/farpoint.yaml.
[[nodiscard]] std::span<const ConfigKey> config_keys();
// "an integer from 1 to 100 (px)".
[[nodiscard]] std::string expectation(const ConfigKey& key);
// "[px; 1 to 100; default 15]": the line that config/farpoint.yaml carries above the key.
[[nodiscard]] std::string documentation_line(const ConfigKey& key);

// The place where each key was last set ("FILE:LINE" or "--set"); a missing key has its built-in default.
using ConfigOrigins = std::map<std::string, std::string>;

// A key of an earlier version.
struct DroppedKey {
  std::string name;
  std::string heir;  // what to set instead; empty: nothing
};
// All of them. A key that is taken off config_keys() is added here.
[[nodiscard]] std::span<const DroppedKey> dropped_keys();

// Reads a YAML file, or its text, over *config. Throws ConfigError. A kept file may hold dropped keys: they
// are passed over, and *warnings gets one line for each. `dropped`: the table, for tests.
void load_config_file(const std::string& path, Config* config, ConfigOrigins* origins,
                      std::vector<std::string>* warnings = nullptr);
void load_config_text(const std::string& text, const std::string& file_name, Config* config,
                      ConfigOrigins* origins, std::vector<std::string>* warnings = nullptr,
                      std::span<const DroppedKey> dropped = dropped_keys());
// Applies one "dotted.key=value" of the command line. Throws ConfigError.
void apply_setting(const std::string& assignment, Config* config, ConfigOrigins* origins);
// Checks conditions between keys. Throws ConfigError.
void check_relations(const Config& config, const ConfigOrigins& origins);

// Layout of the frames of the section can. Throws ConfigError where its keys give none.
[[nodiscard]] ipc::CanLayout can_layout(const CanConfig& config);

// Canonical text of one key's value. Throws std::out_of_range for an unknown name.
[[nodiscard]] std::string value_text(const Config& config, const std::string& name);
// Every key as YAML, in table order and in one spelling: equal texts mean equal configurations, and
// load_config_text() reads it back.
[[nodiscard]] std::string canonical_text(const Config& config);
// FNV-1a, 64 bit, of the canonical text.
[[nodiscard]] std::uint64_t config_hash(const Config& config);
[[nodiscard]] std::uint64_t fnv1a_64(const std::string& text);

}  // namespace farpoint::daemon
