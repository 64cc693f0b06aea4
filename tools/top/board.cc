// SPDX-License-Identifier: Apache-2.0
#include "tools/top/board.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "ipc/reason.h"
#include "slam/frame_result.h"
#include "tools/evaluate/own_metrics.h"

namespace farpoint::tools {
namespace {

constexpr double kStale_s = 1.0;    // the status comes five times a second
constexpr double kInTime_s = 0.25;  // an older pose is no longer valid on CAN
constexpr double kMegabyte = 1e6, kDegrees_per_rad = 57.29577951308232;

constexpr const char *kRed = "\x1b[1;31m", *kYellow = "\x1b[1;33m", *kGreen = "\x1b[1;32m",
                     *kPlain = "\x1b[0m";

std::string painted(const std::string& text, const char* colour, bool with_colour) {
  return with_colour ? colour + text + kPlain : text;
}

const char* colour_of(int state) {
  if (state == status_t::STATE_TRACKING) return kGreen;
  if (state == status_t::STATE_LOST || state == status_t::STATE_NO_CAMERA) return kRed;
  return kYellow;
}

// Names the functions whose bits are set in status_t.side_missing.
std::string missing_functions(std::int32_t bits) {
  struct Name {
    std::int32_t bit;
    const char* text;
  };
  constexpr std::array kNames = {Name{status_t::SIDE_LCM, "LCM"},
                                 Name{status_t::SIDE_OUTPUT_LOG, "output log"},
                                 Name{status_t::SIDE_LIVE_TRAJECTORY, "trajectory"},
                                 Name{status_t::SIDE_CAN_LOG, "CAN log"},
                                 Name{status_t::SIDE_RECORDING, "recording"},
                                 Name{status_t::SIDE_LOG_FILE, "log file"},
                                 Name{status_t::SIDE_MAVLINK, "MAVLink"}};
  std::string text;
  for (const Name& name : kNames)
    if ((bits & name.bit) != 0) text += (text.empty() ? "" : ", ") + std::string(name.text);
  return text;
}

// Root of the trace of one 3x3 block: the size of the error; a dash where it is unknown.
std::string sigmas(const double covariance[6][6], int first, double factor, const char* unit) {
  double variance = 0.0;
  for (int i = first; i < first + 3; ++i) variance += covariance[i][i];
  return std::isfinite(variance) && variance >= 0.0
             ? fmt::format("{:.3g} {}", factor * std::sqrt(variance), unit)
             : "-";
}

void forget_before(double time_s, std::deque<double>* times) {
  while (!times->empty() && times->front() < time_s) times->pop_front();
}

double rate_hz(const std::deque<double>& times_s, double now_s, double window_s) {
  if (times_s.size() < 2) return 0.0;
  const auto first = std::lower_bound(times_s.begin(), times_s.end(), now_s - window_s);
  const auto count = std::distance(first, times_s.end());
  if (count < 2) return 0.0;
  return static_cast<double>(count - 1) / (times_s.back() - *first);
}

// p50, p99, maximum, of values that are not negative.
std::string spread(std::vector<double> values) {
  values.erase(std::remove_if(values.begin(), values.end(), [](double v) { return !(v >= 0.0); }),
               values.end());
  if (values.empty()) return "-";
  std::sort(values.begin(), values.end());
  const auto at = [&](double q) {
    return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
  };
  return fmt::format("p50 {:.1f}  p99 {:.1f}  max {:.1f} ms", at(0.5), at(0.99), values.back());
}

std::string scale_text(const status_t& s) {
  if (s.scale_state == status_t::SCALE_ASSUMED) return "assumed";
  if (s.scale_state != status_t::SCALE_METRIC) return "unknown";
  return s.metre_source == status_t::METRE_WHEELS ? "metric by wheels" : "metric by two cameras";
}

const char* wheels_text(int wheels) {
  switch (wheels) {
    case status_t::WHEELS_STARTING:
      return "wheels    not judged yet\n";
    case status_t::WHEELS_USED:
      return "wheels    used\n";
    case status_t::WHEELS_CONTRADICTED:
      return "wheels    contradict the images, not used\n";
    default:
      return "";
  }
}

}  // namespace

const char* state_name(int state) {
  return state >= 0 && state <= static_cast<int>(slam::State::kNoCamera)
             ? slam::to_string(static_cast<slam::State>(state))
             : "?";
}

const char* can_state_name(int state) {
  constexpr std::array names = {"unknown", "active", "warning", "error passive", "bus off", "down", "absent"};
  return state >= 0 && state < static_cast<int>(names.size()) ? names[static_cast<std::size_t>(state)] : "?";
}

const char* bus_text(const status_t& status) {
  const bool in_use = status.can_state != status_t::CAN_UNKNOWN || status.can_send_errors > 0 ||
                      status.can_bus_offs > 0 || status.can_received > 0;
  return in_use ? can_state_name(status.can_state) : "off";
}

void Board::take(const odometry_t& message, double now_s) {
  if (!first_s_) first_s_ = now_s;
  if (message.valid != 0) last_valid_s_ = now_s;
  odometry_ = message;
  odometry_s_ = now_s;
  odometry_times_s_.push_back(now_s);
  forget_before(now_s - kWindow_s, &odometry_times_s_);
}

void Board::take(const status_t& message, double now_s) {
  if (!first_s_) first_s_ = now_s;
  // A restarted daemon counts anew.
  if (!images_.empty() && message.frames_received < images_.back().received) images_.clear();
  images_.push_back({now_s, message.frames_received});
  while (images_.front().arrived_s < now_s - kWindow_s) images_.pop_front();
  status_ = message;
  status_s_ = now_s;
  status_times_s_.push_back(now_s);
  forget_before(now_s - kWindow_s, &status_times_s_);
}

void Board::take(const timing_t& message, double now_s) {
  if (timing_ && message.process_cpu_s < timing_->process_cpu_s) timings_.clear();
  timing_ = message;
  timings_.push_back(
      {now_s, message.latency_ms, message.wall_ms[timing_t::STAGE_TRACKING], message.process_cpu_s});
  while (timings_.front().arrived_s < now_s - kWindow_s) timings_.pop_front();
}

std::string Board::render(double now_s, bool colour) const {
  std::string text = state_lines(now_s, colour);
  if (status_) text += pose_lines() + time_lines(now_s) + count_lines() + fault_lines() + process_lines();
  if (undecodable_ > 0) text += fmt::format("{} messages of another version of the types\n", undecodable_);
  return text;
}

std::string Board::state_lines(double now_s, bool colour) const {
  if (!status_) return painted("no farpointd heard", kRed, colour) + "  (FARPOINT_STATUS has not come yet)\n";
  const status_t& s = *status_;
  std::string name = state_name(s.state);
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::toupper(c); });
  std::string line = painted(name, colour_of(s.state), colour);
  if (now_s - status_s_ > kStale_s) {
    line = painted(fmt::format("SILENT for {:.0f} s", now_s - status_s_), kRed, colour) + ", last " + name;
  }
  line += s.quality >= 0 ? fmt::format("   quality {}", s.quality) : "   quality -";
  line += fmt::format("   scale {}   map {}   resets {}   lost {} times\n", scale_text(s), s.map_id,
                      s.reset_counter, s.times_lost);
  const std::string why = reason(now_s);
  if (!why.empty()) line += "reason    " + why.substr(0, 88) + "\n";
  return line + "valid     " + last_valid_text(now_s) + "\n\n";
}

std::string Board::reason(double now_s) const {
  if (!status_->message.empty()) return status_->message;
  std::array<char, ipc::kReasonText> buffer;
  const std::string_view text = ipc::reason_text(static_cast<ipc::Reason>(status_->reason),
                                                 status_->reason_value, status_->reason_wanted, buffer);
  if (!text.empty()) return std::string(text);
  if (!odometry_) return "no odometry received";
  const double age_s = now_s - odometry_s_;
  return age_s > kInTime_s ? fmt::format("no pose in time: the last odometry came {:.1f} s ago", age_s) : "";
}

std::string Board::last_valid_text(double now_s) const {
  if (last_valid_s_) return fmt::format("last valid pose {:.1f} s ago", now_s - *last_valid_s_);
  return fmt::format("no valid pose since top began to listen, {:.0f} s ago",
                     now_s - first_s_.value_or(now_s));
}

std::string Board::pose_lines() const {
  if (!odometry_ || !odometry_->valid) return "odom      no valid pose\n" + sigma_line();
  const odometry_t& o = *odometry_;
  const double w = o.orientation[0], x = o.orientation[1], y = o.orientation[2], z = o.orientation[3];
  const double heading = kDegrees_per_rad * std::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z));
  const char* unit = o.scale_state == status_t::SCALE_UNKNOWN ? "units" : "m";
  return fmt::format("odom      x {:.2f}  y {:.2f}  z {:.2f} {}   heading {:.1f} deg   speed {:.2f} {}/s\n",
                     o.position[0], o.position[1], o.position[2], unit, heading,
                     std::hypot(o.velocity[0], o.velocity[1], o.velocity[2]), unit) +
         sigma_line();
}

std::string Board::sigma_line() const {
  if (!odometry_ || !odometry_->valid) return "sigma     position -   attitude -   velocity -\n";
  const odometry_t& o = *odometry_;
  const std::string unit = o.scale_state == status_t::SCALE_UNKNOWN ? "units" : "m", speed = unit + "/s";
  return fmt::format("sigma     position {}   attitude {}   velocity {}\n",
                     sigmas(o.pose_covariance, 0, 1.0, unit.c_str()),
                     sigmas(o.pose_covariance, 3, kDegrees_per_rad, "deg"),
                     sigmas(o.twist_covariance, 0, 1.0, speed.c_str()));
}

std::string Board::time_lines(double now_s) const {
  std::vector<double> latency_ms, tracking_ms;
  for (const Times& t : timings_) {
    latency_ms.push_back(t.latency_ms);
    tracking_ms.push_back(t.tracking_ms);
  }
  std::string text = fmt::format("rates     odometry {:.1f} Hz   status {:.1f} Hz   images {:.1f} Hz\n",
                                 rate_hz(odometry_times_s_, now_s, kWindow_s),
                                 rate_hz(status_times_s_, now_s, kWindow_s), images_hz());
  text += "latency   " + spread(std::move(latency_ms)) + "   (mid-exposure to output)\n";
  return text + "tracking  " + spread(std::move(tracking_ms)) + "\n";
}

double Board::images_hz() const {
  if (images_.size() < 2) return 0.0;
  const double passed_s = images_.back().arrived_s - images_.front().arrived_s;
  const auto count = static_cast<double>(images_.back().received - images_.front().received);
  return passed_s > 0.0 ? count / passed_s : 0.0;
}

double Board::cpu_percent() const {
  if (timings_.size() < 2) return NAN;
  const double passed_s = timings_.back().arrived_s - timings_.front().arrived_s;
  const double used_s = timings_.back().process_cpu_s - timings_.front().process_cpu_s;
  return passed_s > 0.0 ? 100.0 * used_s / passed_s : NAN;
}

std::string Board::camera_line() const {
  const status_t& s = *status_;
  if (s.camera.empty()) return "";
  std::string text = "camera    " + s.camera;
  if (!s.camera_format.empty()) text += "   " + s.camera_format;
  if (s.camera_rate_hz > 0.0) text += fmt::format(" at {:.4g} Hz", s.camera_rate_hz);
  text += s.camera_exposure_us >= 0
              ? fmt::format("   exposure {:.3g} ms", 1e-3 * static_cast<double>(s.camera_exposure_us))
              : "   exposure unknown";
  if (s.camera_gain >= 0.0) text += fmt::format("   gain {:.3g}", s.camera_gain);
  return text + "\n";
}

std::string Board::count_lines() const {
  const status_t& s = *status_;
  std::string text;
  text += fmt::format(
      "queues    capture {} (most {})   mapping {} ({})   publish {} ({})   features a frame {}\n",
      s.capture_queue, s.capture_queue_max, s.mapping_queue, s.mapping_queue_max, s.publish_queue,
      s.publish_queue_max, s.features_asked);
  text += camera_line();
  text +=
      fmt::format("images    {} in   {} dropped   {} missing   {} flagged   {} undecodable   lost {} times\n",
                  s.frames_received, s.frames_dropped, s.images_missing, s.images_flagged,
                  s.images_undecodable, s.camera_losses);
  if (s.stereo_pairs > 0 || s.stereo_left_alone > 0 || s.stereo_right_alone > 0) {
    text +=
        fmt::format("stereo    {} pairs   {} left alone   {} right alone   skew {:.1f} ms\n", s.stereo_pairs,
                    s.stereo_left_alone, s.stereo_right_alone, 1e-3 * static_cast<double>(s.stereo_skew_us));
  }
  text += wheels_text(s.wheels);
  text += fmt::format("frames    {} tracked   {} valid   {} late   {} keyframes not made\n", s.frames_tracked,
                      s.frames_valid, s.deadlines_missed, s.keyframes_dropped);
  const MapCounts map = map_counts(s);
  return text +
         fmt::format("map       {} keyframes   {} points   {} virtual points   (points have a depth)\n",
                     map.keyframes, map.points, map.vmps);
}

std::string Board::fault_lines() const {
  const status_t& s = *status_;
  const std::string bus = bus_text(s);
  std::string text = "CAN       " + bus;
  if (bus != "off")
    text += fmt::format("   {} not sent   {} bus-offs   {} received", s.can_send_errors, s.can_bus_offs,
                        s.can_received);
  if (s.mavlink_sent + s.mavlink_without_scale + s.mavlink_without_pose > 0) {
    const std::string answered =
        s.mavlink_round_trip_us < 0 ? "no answer" : fmt::format("round trip {} us", s.mavlink_round_trip_us);
    text += fmt::format("\nMAVLink   {} sent   {} without metres   {} without pose   {} errors   {}",
                        s.mavlink_sent, s.mavlink_without_scale, s.mavlink_without_pose,
                        s.mavlink_send_errors, answered);
  }
  text += fmt::format(
      "\nerrors    {} LCM   {} log   {} not recorded   {} times backwards   {} stamps of no clock\n",
      s.lcm_send_errors, s.log_write_errors, s.images_not_recorded, s.times_backwards, s.times_unknown);
  if (s.side_missing != 0)
    text += fmt::format("missing   {}   {} attempts failed\n", missing_functions(s.side_missing),
                        s.side_failures);
  return text;
}

std::string Board::process_lines() const {
  const status_t& s = *status_;
  std::string text;
  if (timing_) {
    const double cpu = cpu_percent();
    text += std::isfinite(cpu) ? fmt::format("CPU       {:.0f} % of one core\n", cpu) : "CPU       -\n";
    text += fmt::format("memory    {:.0f} MB now, {:.0f} MB most, {:.0f} MB of it pools\n",
                        static_cast<double>(timing_->resident_bytes) / kMegabyte,
                        static_cast<double>(timing_->peak_resident_bytes) / kMegabyte,
                        static_cast<double>(s.memory_pool_bytes) / kMegabyte);
  }
  return text + fmt::format("\n{}   configuration {}   calibration {}\n", s.build, s.configuration_hash,
                            s.calibration_hash);
}

}  // namespace farpoint::tools
