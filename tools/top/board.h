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
    double arrived_s = 0, latency_ms = 0, tracking_ms = 0;
  };
  [[nodiscard]] std::string state_lines(double now_s, bool colour) const;
  [[nodiscard]] std::string pose_lines() const;
  [[nodiscard]] std::string time_lines(double now_s) const;
  [[nodiscard]] std::string count_lines() const;

  std::optional<odometry_t> odometry_;
  std::optional<status_t> status_;
  std::optional<timing_t> timing_;
  double odometry_s_ = 0, status_s_ = 0;
  std::deque<double> odometry_times_s_, status_times_s_;
  std::deque<Times> timings_;
  std::int64_t undecodable_ = 0;
};

[[nodiscard]] const char* state_name(int state);
[[nodiscard]] const char* can_state_name(int state);

}  // namespace farpoint::tools
