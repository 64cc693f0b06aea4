// SPDX-License-Identifier: Apache-2.0
// The table of all configuration keys. Ranges are wide on purpose: they stop typing errors and what cannot
// work, not experiments.
#include <charconv>
#include <cmath>
#include <system_error>

#include "daemon/config/config.h"

namespace farpoint::daemon {
namespace {

// The shortest text that reads back to the same bits, without an exponent where a human would not use one.
std::string shortest(double value) {
  char buffer[64];
  const bool plain = value == 0.0 || (std::abs(value) >= 1e-6 && std::abs(value) < 1e9);
  const auto format = plain ? std::chars_format::fixed : std::chars_format::scientific;
  const auto result = std::to_chars(buffer, buffer + sizeof(buffer), value, format);
  return {buffer, result.ptr};
}

template <typename T>
T parse_checked(const std::string& text) {
  T value{};
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

template <typename Field>
ConfigKey integer(const char* name, const char* unit, int min, int max, Field field) {
  ConfigKey key{name, KeyType::kInteger, unit, static_cast<double>(min), static_cast<double>(max), {}, {},
                {}};
  key.get = [field](const Config& c) { return std::to_string(field(c)); };
  key.set = [field](Config& c, const std::string& text) { field(c) = parse_checked<int>(text); };
  return key;
}

template <typename Field>
ConfigKey number(const char* name, const char* unit, double min, double max, Field field) {
  ConfigKey key{name, KeyType::kNumber, unit, min, max, {}, {}, {}};
  key.get = [field](const Config& c) { return shortest(field(c)); };
  key.set = [field](Config& c, const std::string& text) { field(c) = parse_checked<double>(text); };
  return key;
}

template <typename Field>
ConfigKey text(const char* name, Field field) {
  ConfigKey key{name, KeyType::kText, "", 0.0, 0.0, {}, {}, {}};
  key.get = [field](const Config& c) { return std::string(field(c)); };
  key.set = [field](Config& c, const std::string& value) { field(c) = value; };
  return key;
}

template <typename Field>
ConfigKey choice(const char* name, std::vector<std::string> choices, Field field) {
  ConfigKey key = text(name, field);
  key.type = KeyType::kChoice;
  key.choices = std::move(choices);
  return key;
}

// An enum whose values 0, 1, ... are called by `choices` in this order.
template <typename Field>
ConfigKey enumeration(const char* name, const std::vector<std::string>& choices, Field field) {
  ConfigKey key{name, KeyType::kChoice, "", 0.0, 0.0, choices, {}, {}};
  key.get = [field, choices](const Config& c) { return choices.at(static_cast<std::size_t>(field(c))); };
  key.set = [field, choices](Config& c, const std::string& value) {
    std::size_t index = 0;
    while (choices.at(index) != value) ++index;
    field(c) = static_cast<std::remove_reference_t<decltype(field(c))>>(index);
  };
  return key;
}

template <typename Field>
ConfigKey boolean(const char* name, Field field) {
  return enumeration(name, {"false", "true"}, field);
}

// A function object that gives the named field, const or not like the configuration.
#define FIELD(path) ([](auto& c) -> auto& { return c.path; })

std::vector<ConfigKey> make_keys() {
  return {
      choice("log.level", {"debug", "info", "warning", "error"}, FIELD(log.level)),
      text("log.file", FIELD(log.file)),
      integer("log.file_mb", "MB", 1, 1000, FIELD(log.file_mb)),
      integer("log.files", "files", 1, 100, FIELD(log.files)),

      text("control.socket", FIELD(control.socket)),

      text("state.folder", FIELD(state.folder)),

      integer("record.max_size_mb", "MB", 0, 100000000, FIELD(record.max_size_mb)),
      number("record.max_minutes", "min", 0, 1000000, FIELD(record.max_minutes)),
      number("record.min_free_share", "", 0, 0.9, FIELD(record.min_free_share)),
      integer("record.waiting_images", "images", 2, 300, FIELD(record.waiting_images)),

      integer("camera.index", "", 0, 15, FIELD(camera.index)),
      text("camera.mask", FIELD(camera.mask)),
      text("camera.second_mask", FIELD(camera.second_mask)),
      enumeration("camera.use", {"all", "one"}, FIELD(camera.use)),
      enumeration("camera.driver", {"v4l2", "libcamera", "file", "lcm"}, FIELD(camera.driver)),
      text("camera.device", FIELD(camera.device)),
      text("camera.calibration", FIELD(camera.calibration)),
      text("camera.second_device", FIELD(camera.second_device)),
      text("camera.second_calibration", FIELD(camera.second_calibration)),
      integer("camera.pair_tolerance_us", "us", 0, 100000, FIELD(camera.pair_tolerance_us)),
      enumeration("camera.format", {"auto", "grey", "nv12", "yuyv", "rgb24", "mjpeg"}, FIELD(camera.format)),
      number("camera.rate_hz", "Hz", 0, 1000, FIELD(camera.rate_hz)),
      integer("camera.buffers", "buffers", 2, 16, FIELD(camera.buffers)),
      enumeration("camera.stamp", {"auto", "start_of_exposure", "start_of_readout", "end_of_frame"},
                  FIELD(camera.stamp)),
      integer("camera.time_offset_us", "us", -1000000, 1000000, FIELD(camera.time_offset_us)),
      number("camera.stall_s", "s", 0.1, 60, FIELD(camera.stall_s)),
      number("camera.open_limit_s", "s", 1, 600, FIELD(camera.open_limit_s)),
      number("camera.lost_after_s", "s", 0.01, 10, FIELD(camera.lost_after_s)),
      enumeration("camera.exposure", {"camera", "auto", "manual"}, FIELD(camera.exposure.mode)),
      number("camera.exposure_us", "us", 1, 1e6, FIELD(camera.exposure.manual_us)),
      integer("camera.gain", "", 0, 1000000, FIELD(camera.exposure.manual_gain)),
      number("camera.exposure_short_us", "us", 1, 1e6, FIELD(camera.exposure.short_us)),
      number("camera.exposure_max_us", "us", 1, 1e6, FIELD(camera.exposure.max_us)),
      number("camera.gain_share", "", 0, 1, FIELD(camera.exposure.max_gain_share)),
      number("camera.brightness", "grey levels", 10, 240, FIELD(camera.exposure.target_grey)),

      number("scale.assumed", "m/map unit", 0, 1e6, FIELD(scale.assumed)),

      boolean("lcm.enabled", FIELD(lcm.enabled)),
      text("lcm.url", FIELD(lcm.url)),
      number("lcm.status_rate_hz", "Hz", 0.1, 1000, FIELD(lcm.status_rate_hz)),
      number("lcm.map_rate_hz", "Hz", 0, 100, FIELD(lcm.map_rate_hz)),
      integer("lcm.map_points", "points", 0, 100000, FIELD(lcm.map_points)),

      boolean("can.enabled", FIELD(can.enabled)),
      text("can.interface", FIELD(can.interface)),
      enumeration("can.frame", {"map", "odom"}, FIELD(can.frame)),
      boolean("can.fd", FIELD(can.fd)),
      number("can.rate_hz", "Hz", 1, 1000, FIELD(can.rate_hz)),
      integer("can.base_id", "", 1, 536870911, FIELD(can.base_id)),
      boolean("can.extended_ids", FIELD(can.extended_ids)),
      integer("can.base_data_id", "", 0, 65526, FIELD(can.base_data_id)),
      text("can.messages", FIELD(can.messages)),
      text("can.wheels_dbc", FIELD(can.wheels_dbc)),
      text("can.wheel_signals", FIELD(can.wheel_signals)),

      boolean("mavlink.enabled", FIELD(mavlink.enabled)),
      text("mavlink.link", FIELD(mavlink.link)),
      number("mavlink.rate_hz", "Hz", 1, 100, FIELD(mavlink.rate_hz)),
      integer("mavlink.system_id", "", 1, 255, FIELD(mavlink.system_id)),
      integer("mavlink.component_id", "", 1, 255, FIELD(mavlink.component_id)),

      boolean("realtime.lock_memory", FIELD(realtime.lock_memory)),
      integer("realtime.stack_kb", "kB", 256, 16384, FIELD(realtime.stack_kb)),
      integer("realtime.capture_queue", "images", 1, 100, FIELD(realtime.capture_queue)),
      number("realtime.least_features", "", 0.2, 1, FIELD(realtime.least_features)),
      enumeration("realtime.profile", {"desk", "vehicle"}, FIELD(realtime.profile)),
      enumeration("realtime.policy", {"fifo", "rr"}, FIELD(realtime.policy)),
      integer("realtime.capture_priority", "", -1, 90, FIELD(realtime.capture.priority)),
      integer("realtime.capture_core", "", -1, 1023, FIELD(realtime.capture.core)),
      integer("realtime.tracking_priority", "", -1, 90, FIELD(realtime.tracking.priority)),
      integer("realtime.tracking_core", "", -1, 1023, FIELD(realtime.tracking.core)),
      integer("realtime.output_priority", "", -1, 90, FIELD(realtime.output.priority)),
      integer("realtime.output_core", "", -1, 1023, FIELD(realtime.output.core)),
      integer("realtime.mapping_priority", "", -1, 90, FIELD(realtime.mapping.priority)),
      integer("realtime.mapping_core", "", -1, 1023, FIELD(realtime.mapping.core)),
      number("realtime.deadline_ms", "ms", 0, 100000, FIELD(realtime.deadline_ms)),
      integer("realtime.cpu_latency_us", "us", -1, 1000000, FIELD(realtime.cpu_latency_us)),
      boolean("realtime.require", FIELD(realtime.require)),
      integer("realtime.disk_ring_mb", "MB", 1, 1000, FIELD(realtime.disk_ring_mb)),

      number("watchdog.capture_s", "s", 0.2, 60, FIELD(watchdog.capture_s)),
      number("watchdog.tracking_s", "s", 0.05, 60, FIELD(watchdog.tracking_s)),
      number("watchdog.mapping_s", "s", 0.05, 60, FIELD(watchdog.mapping_s)),
      number("watchdog.output_s", "s", 0.05, 60, FIELD(watchdog.output_s)),

      integer("pyramid.levels", "levels", 1, 16, FIELD(estimator.pyramid.levels)),
      number("pyramid.scale_factor", "", 1.05, 2, FIELD(estimator.pyramid.scale_factor)),

      integer("extractor.features", "features", 50, 20000, FIELD(estimator.extractor.features)),
      integer("extractor.fast_threshold", "grey levels", 1, 255, FIELD(estimator.extractor.fast_threshold)),
      integer("extractor.fast_threshold_min", "grey levels", 1, 255,
              FIELD(estimator.extractor.fast_threshold_min)),
      integer("extractor.cell_px", "px", 8, 512, FIELD(estimator.extractor.cell_px)),

      integer("capacity.keyframes", "keyframes", 10, 100000, FIELD(estimator.capacity.keyframes)),
      integer("capacity.landmarks", "landmarks", 500, 5000000, FIELD(estimator.capacity.landmarks)),
      integer("capacity.observations_per_landmark", "observations", 4, 1000,
              FIELD(estimator.capacity.observations_per_landmark)),
      integer("capacity.window_images", "images", 2, 1000, FIELD(estimator.capacity.window_images)),
      integer("capacity.image_mb", "MB", 1, 1000000, FIELD(image_mb)),
      integer("capacity.view_landmarks", "landmarks", 500, 1000000, FIELD(estimator.capacity.view_landmarks)),

      number("initialisation.min_parallax_rad", "rad", 1e-4, 1,
             FIELD(estimator.initialisation.min_parallax_rad)),
      integer("initialisation.min_landmarks", "landmarks", 10, 20000,
              FIELD(estimator.initialisation.min_landmarks)),
      number("initialisation.max_age_s", "s", 0.1, 1000, FIELD(estimator.initialisation.max_age_s)),

      number("tracking.prior_search_px", "px", 1, 500, FIELD(estimator.tracking.prior_search_px)),
      number("tracking.local_search_px", "px", 0.5, 100, FIELD(estimator.tracking.local_search_px)),
      integer("tracking.min_matches", "matches", 4, 20000, FIELD(estimator.tracking.min_matches)),
      integer("tracking.min_inliers", "landmarks", 4, 20000, FIELD(estimator.tracking.min_inliers)),
      integer("tracking.degraded_inliers", "landmarks", 4, 20000, FIELD(estimator.tracking.degraded_inliers)),
      integer("tracking.max_hamming", "bits", 1, 256, FIELD(estimator.tracking.max_hamming)),
      number("tracking.pixel_sigma_px", "px", 0.01, 10, FIELD(estimator.tracking.pixel_sigma_px)),

      number("keyframes.tracked_ratio", "", 0.05, 1, FIELD(estimator.keyframes.tracked_ratio)),
      number("keyframes.min_interval_s", "s", 0, 100, FIELD(estimator.keyframes.min_interval_s)),
      number("keyframes.max_interval_s", "s", 0, 10000, FIELD(estimator.keyframes.max_interval_s)),
      number("keyframes.min_parallax_rad", "rad", 1e-4, 1, FIELD(estimator.keyframes.min_parallax_rad)),

      enumeration("landmarks.mode", {"baseline", "vmp"}, FIELD(estimator.landmarks.mode)),
      number("landmarks.promote_parallax_rad", "rad", 1e-5, 1,
             FIELD(estimator.landmarks.promote_parallax_rad)),
      number("landmarks.promote_relative_sigma", "", 0.001, 1,
             FIELD(estimator.landmarks.promote_relative_sigma)),
      integer("landmarks.bearing_observations", "keyframes", 3, 1000000,
              FIELD(estimator.landmarks.bearing_observations)),
      integer("landmarks.max_bearing", "landmarks", 0, 5000000, FIELD(estimator.landmarks.max_bearing)),

      integer("mapping.neighbours", "keyframes", 1, 1000, FIELD(estimator.mapping.neighbours)),
      integer("mapping.window_keyframes", "keyframes", 2, 1000, FIELD(estimator.mapping.window_keyframes)),
      integer("mapping.window_landmarks", "landmarks", 50, 5000000,
              FIELD(estimator.mapping.window_landmarks)),
      integer("mapping.window_sightings", "sightings", 200, 50000000,
              FIELD(estimator.mapping.window_sightings)),
      integer("mapping.fixed_keyframes", "keyframes", 0, 10000, FIELD(estimator.mapping.fixed_keyframes)),
      integer("mapping.iterations", "steps", 1, 1000, FIELD(estimator.mapping.iterations)),
      number("mapping.quick_view_delay_ms", "ms", 0, 10000, FIELD(estimator.mapping.quick_view_delay_ms)),
      number("mapping.full_view_delay_ms", "ms", 0, 10000, FIELD(estimator.mapping.full_view_delay_ms)),
      choice("mapping.solver", {"schur", "ceres"}, FIELD(estimator.mapping.solver)),

      boolean("calibration.refine", FIELD(estimator.calibration.refine)),
      number("calibration.focal_sigma", "", 1e-6, 0.5, FIELD(estimator.calibration.focal_sigma)),
      number("calibration.centre_sigma_px", "px", 1e-3, 200, FIELD(estimator.calibration.centre_sigma_px)),
      number("calibration.distortion_sigma", "", 1e-6, 1, FIELD(estimator.calibration.distortion_sigma)),
      number("calibration.information_share", "", 1e-4, 1, FIELD(estimator.calibration.information_share)),
      integer("calibration.min_keyframes", "keyframes", 2, 1000, FIELD(estimator.calibration.min_keyframes)),
      number("odometry.correction_share", "", 0, 1, FIELD(estimator.odometry.correction_share)),
      number("odometry.correction_rad_per_s", "rad/s", 0, 10, FIELD(estimator.odometry.correction_rad_per_s)),

      boolean("wheels.use", FIELD(estimator.wheels.use)),
      number("wheels.x_m", "m", -100, 100, FIELD(estimator.wheels.x_m)),
      number("wheels.y_m", "m", -100, 100, FIELD(estimator.wheels.y_m)),
      number("wheels.z_m", "m", -100, 100, FIELD(estimator.wheels.z_m)),
      number("wheels.track_m", "m", 0, 10, FIELD(estimator.wheels.track_m)),
      number("wheels.delay_ms", "ms", -1000, 1000, FIELD(estimator.wheels.delay_ms)),
      number("wheels.factor", "", 0.01, 100, FIELD(estimator.wheels.factor)),
      number("wheels.scale_sigma", "", 1e-4, 0.5, FIELD(estimator.wheels.scale_sigma)),
      number("wheels.speed_sigma_mps", "m/s", 1e-4, 10, FIELD(estimator.wheels.speed_sigma_mps)),
      number("wheels.yaw_rate_sigma_radps", "rad/s", 1e-5, 10, FIELD(estimator.wheels.yaw_rate_sigma_radps)),
      number("wheels.slip_sigma", "", 0, 0.5, FIELD(estimator.wheels.slip_sigma)),
      number("wheels.gate_sigmas", "sigma", 0, 100, FIELD(estimator.wheels.gate_sigmas)),
      number("wheels.max_gap_s", "s", 0.01, 10, FIELD(estimator.wheels.max_gap_s)),
      number("wheels.blind_s", "s", 0, 600, FIELD(estimator.wheels.blind_s)),
  };
}

#undef FIELD

std::string range_text(const ConfigKey& key) {
  if (key.type == KeyType::kText) return "text";
  if (key.type != KeyType::kChoice) return shortest(key.min) + " to " + shortest(key.max);
  std::string list;
  for (const std::string& choice : key.choices) list += (list.empty() ? "" : " | ") + choice;
  return list;
}

}  // namespace

std::span<const ConfigKey> config_keys() {
  static const std::vector<ConfigKey> keys = make_keys();
  return keys;
}

std::span<const DroppedKey> dropped_keys() {
  // Frames became seconds, and pixels angles.
  static const std::vector<DroppedKey> keys{
      {"initialisation.max_frames", "initialisation.max_age_s"},
      {"keyframes.min_interval_frames", "keyframes.min_interval_s"},
      {"keyframes.max_interval_frames", "keyframes.max_interval_s"},
      {"keyframes.min_parallax_px", "keyframes.min_parallax_rad"},
      {"mapping.quick_view_delay_frames", "mapping.quick_view_delay_ms"},
      {"mapping.full_view_delay_frames", "mapping.full_view_delay_ms"},
  };
  return keys;
}

std::string expectation(const ConfigKey& key) {
  const std::string unit = key.unit.empty() ? "" : " (" + key.unit + ")";
  switch (key.type) {
    case KeyType::kInteger:
      return "an integer from " + range_text(key) + unit;
    case KeyType::kNumber:
      return "a number from " + range_text(key) + unit;
    case KeyType::kText:
      return "text";
    case KeyType::kChoice:
      return "one of " + range_text(key);
  }
  return "";
}

std::string documentation_line(const ConfigKey& key) {
  const std::string unit = key.unit.empty() ? "" : key.unit + "; ";
  return "[" + unit + range_text(key) + "; default " + key.get(Config{}) + "]";
}

}  // namespace farpoint::daemon
