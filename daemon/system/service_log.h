// SPDX-License-Identifier: Apache-2.0
// The log of a service: to the journal (or standard error) and a rotating file, written on a thread of its
// own (fp-log). Logging threads never wait; the message rate is limited. Every message is one line: control
// characters are escaped, so that no text from outside forges a line or its priority.
#pragma once

#include <memory>
#include <vector>

#include <spdlog/sinks/base_sink.h>

#include "daemon/config/config.h"

namespace farpoint::daemon {

// Replaces the log of start_logging(). Without the file: see open_log_file().
void start_service_log(const LogConfig& config);
// Any thread, once: log lines go to the rotating file too. Throws std::runtime_error if it cannot be written.
// Precondition: the service's log runs, and config.file names a file.
void open_log_file(const LogConfig& config);
// Writes the remaining messages.
void stop_service_log();

// Hands a message to a sink as one line of printable characters.
void hand_on_one_line(const spdlog::details::log_msg& message, spdlog::sinks::sink* sink);

// Passes at most kBurst messages at once and kPerSecond a second after that. Reports the number of dropped
// ones when there is room again. Errors always pass.
class RateLimitedSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  static constexpr double kBurst = 100.0, kPerSecond = 10.0;
  explicit RateLimitedSink(std::vector<spdlog::sink_ptr> sinks) : sinks_(std::move(sinks)) {}

  // Any thread.
  void add(spdlog::sink_ptr sink);

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override;
  void flush_() override;

 private:
  [[nodiscard]] bool may_pass(const spdlog::details::log_msg& message);
  void hand_on(const spdlog::details::log_msg& message);

  std::vector<spdlog::sink_ptr> sinks_;
  double tokens_ = kBurst;
  spdlog::log_clock::time_point last_{};
  std::size_t left_out_ = 0;
};

}  // namespace farpoint::daemon
