// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/logging.h"

#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <mutex>

#include "daemon/system/service_log.h"
#include "daemon/system/stage_clock.h"

namespace farpoint::daemon {
namespace {

// Standard error, one line a message.
class StandardError final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  StandardError() { stream_.set_pattern("farpointd: %l: %v"); }

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override { hand_on_one_line(message, &stream_); }
  void flush_() override { stream_.flush(); }

 private:
  spdlog::sinks::stderr_sink_st stream_;
};

}  // namespace

void start_logging(const std::string& level) {
  auto logger = std::make_shared<spdlog::logger>("farpointd", std::make_shared<StandardError>());
  logger->set_level(spdlog::level::from_str(level));
  spdlog::set_default_logger(std::move(logger));
}

void set_log_level(const std::string& level) {
  spdlog::set_level(spdlog::level::from_str(level));
}

Progress::Progress() : terminal_(isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  clear();
}

void Progress::show(double fraction, const std::string& text) {
  constexpr double kPeriod_s = 0.1;
  constexpr int kWidth = 30;
  if (!terminal_) return;
  const double now_s = steady_s();
  if (drawn_ && now_s - last_drawn_s_ < kPeriod_s) return;
  last_drawn_s_ = now_s;
  drawn_ = true;
  std::string bar;
  if (fraction >= 0.0) {
    const auto filled = static_cast<std::size_t>(std::clamp(fraction, 0.0, 1.0) * kWidth);
    bar = fmt::format("[{}{}] ", std::string(filled, '#'), std::string(kWidth - filled, '.'));
  }
  std::fprintf(stderr, "\r\x1b[K%s%s", bar.c_str(), text.c_str());
  std::fflush(stderr);
}

void Progress::clear() {
  if (!drawn_) return;
  std::fprintf(stderr, "\r\x1b[K");
  std::fflush(stderr);
  drawn_ = false;
}

}  // namespace farpoint::daemon
