// SPDX-License-Identifier: Apache-2.0
// The picture of `farpoint top`: the newest messages of a running farpointd, and rates and latencies over
// several of them.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "ipc/message.h"

namespace farpoint::tools {

class Board {
 public:
  // now_s: time of arrival, by any clock that does not jump.
  void take(const odometry_t& message, double now_s);
  void take(const status_t& message, double now_s);
  void take(const timing_t& message, double now_s);
  // Counts an undecodable message: another version of the types.
  void take_undecodable() { ++undecodable_; }

  // The whole picture, lines of at most 100 characters. colour: with the terminal's codes.
  [[nodiscard]] std::string render(double now_s, bool colour) const;

 private:
  static constexpr double kWindow_s = 5.0;  // window of rates and latencies
  struct Times {
    double arrived_s = 0, latency_ms = 0, tracking_ms = 0, process_cpu_s = 0;
  };
  struct Images {
    double arrived_s = 0;
    std::int64_t received = 0;
  };
  [[nodiscard]] std::string state_lines(double now_s, bool colour) const;
  [[nodiscard]] std::string reason(double now_s) const;  // why no pose is valid; empty for a valid one
  [[nodiscard]] std::string last_valid_text(double now_s) const;
  [[nodiscard]] std::string pose_lines() const;
  [[nodiscard]] std::string sigma_line() const;
  [[nodiscard]] std::string time_lines(double now_s) const;
  [[nodiscard]] double images_hz() const;
  [[nodiscard]] double cpu_percent() const;  // of one core; NaN with fewer than two messages
  [[nodiscard]] std::string camera_line() const;
  [[nodiscard]] std::string count_lines() const;
  [[nodiscard]] std::string fault_lines() const;
  [[nodiscard]] std::string process_lines() const;

  std::optional<odometry_t> odometry_;
  std::optional<status_t> status_;
  std::optional<timing_t> timing_;
  double odometry_s_ = 0, status_s_ = 0;
  std::optional<double> first_s_, last_valid_s_;  // arrival of the first message, and of the last valid pose
  std::deque<double> odometry_times_s_, status_times_s_;
  std::deque<Images> images_;
  std::deque<Times> timings_;
  std::int64_t undecodable_ = 0;
};

[[nodiscard]] const char* state_name(int state);
[[nodiscard]] const char* can_state_name(int state);
// The controller's state, or 'off' where no bus is in use: a bus in use leaves 'unknown' with its first
// frame.
[[nodiscard]] const char* bus_text(const status_t& status);

}  // namespace farpoint::tools
