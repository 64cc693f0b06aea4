// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/service_log.h"

#include <pthread.h>
#include <spdlog/async.h>
#include <spdlog/sinks/rotating_file_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>

#include "ipc/printable.h"

namespace farpoint::daemon {
namespace {

constexpr std::size_t kQueue = 1024;               // messages; when it is full the oldest give way
constexpr std::size_t kLogStackBytes = 256 << 10;  // a usual stack of 8 MB would be locked whole

// The journal reads a message's level from its head: see sd-daemon(3).
int journal_level(spdlog::level::level_enum level) {
  switch (level) {
    case spdlog::level::critical:
      return 2;
    case spdlog::level::err:
      return 3;
    case spdlog::level::warn:
      return 4;
    case spdlog::level::info:
      return 6;
    default:
      return 7;
  }
}

class JournalSink final : public spdlog::sinks::base_sink<std::mutex> {
 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    std::fprintf(stderr, "<%d>%.*s\n", journal_level(message.level), static_cast<int>(message.payload.size()),
                 message.payload.data());
  }
  void flush_() override { std::fflush(stderr); }
};

spdlog::sink_ptr make_stream_sink() {
  if (std::getenv("JOURNAL_STREAM") != nullptr) return std::make_shared<JournalSink>();
  auto sink = std::make_shared<spdlog::sinks::stderr_sink_mt>();
  sink->set_pattern("farpointd: %l: %v");
  return sink;
}

spdlog::sink_ptr make_file_sink(const LogConfig& config) {
  constexpr std::size_t kMegabyte = 1'000'000;
  try {
    auto sink = std::make_shared<spdlog::sinks::rotating_file_sink_mt>(
        config.file, static_cast<std::size_t>(config.file_mb) * kMegabyte,
        static_cast<std::size_t>(config.files));
    sink->set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %l %v");
    return sink;
  } catch (const spdlog::spdlog_ex& error) {
    throw std::runtime_error(config.file + ": " + error.what() + ", expected a file that can be written");
  }
}

// Gives the log's own thread a stack of this size; the library has no option for it.
class DefaultStack {
 public:
  explicit DefaultStack(std::size_t bytes) {
    pthread_attr_init(&before_);
    pthread_getattr_default_np(&before_);
    pthread_attr_t small;
    pthread_attr_init(&small);
    pthread_attr_setstacksize(&small, bytes);
    pthread_setattr_default_np(&small);
    pthread_attr_destroy(&small);
  }
  ~DefaultStack() {
    pthread_setattr_default_np(&before_);
    pthread_attr_destroy(&before_);
  }
  DefaultStack(const DefaultStack&) = delete;
  DefaultStack& operator=(const DefaultStack&) = delete;

 private:
  pthread_attr_t before_{};
};

}  // namespace

void start_service_log(const LogConfig& config) {
  const DefaultStack stack(kLogStackBytes);
  spdlog::init_thread_pool(kQueue, 1, [] { pthread_setname_np(pthread_self(), "fp-log"); });
  auto sink = std::make_shared<RateLimitedSink>(std::vector<spdlog::sink_ptr>{make_stream_sink()});
  auto logger = std::make_shared<spdlog::async_logger>("farpointd", std::move(sink), spdlog::thread_pool(),
                                                       spdlog::async_overflow_policy::overrun_oldest);
  logger->set_level(spdlog::level::from_str(config.level));
  logger->flush_on(spdlog::level::info);
  spdlog::set_default_logger(std::move(logger));
}

void open_log_file(const LogConfig& config) {
  const auto sink = std::dynamic_pointer_cast<RateLimitedSink>(spdlog::default_logger()->sinks().front());
  if (sink != nullptr) sink->add(make_file_sink(config));
}

void stop_service_log() {
  spdlog::shutdown();
}

void RateLimitedSink::add(spdlog::sink_ptr sink) {
  const std::lock_guard<std::mutex> lock(mutex_);
  sinks_.push_back(std::move(sink));
}

void hand_on_one_line(const spdlog::details::log_msg& message, spdlog::sinks::sink* sink) {
  const std::string_view text(message.payload.data(), message.payload.size());
  if (ipc::is_printable_line(text)) return sink->log(message);
  const std::string line = ipc::printable(text);
  spdlog::details::log_msg plain = message;
  plain.payload = line;
  sink->log(plain);
}

void RateLimitedSink::sink_it_(const spdlog::details::log_msg& message) {
  if (!may_pass(message)) {
    ++left_out_;
    return;
  }
  if (left_out_ > 0) {
    const std::string text = fmt::format("{} messages left out, they came too fast", left_out_);
    left_out_ = 0;
    hand_on(spdlog::details::log_msg(message.logger_name, spdlog::level::warn, text));
  }
  hand_on(message);
}

bool RateLimitedSink::may_pass(const spdlog::details::log_msg& message) {
  const double passed_s = std::chrono::duration<double>(message.time - last_).count();
  if (passed_s > 0.0) tokens_ = std::min(kBurst, tokens_ + kPerSecond * passed_s);
  last_ = message.time;
  if (message.level >= spdlog::level::err) return true;
  if (tokens_ < 1.0) return false;
  tokens_ -= 1.0;
  return true;
}

void RateLimitedSink::hand_on(const spdlog::details::log_msg& message) {
  for (const spdlog::sink_ptr& sink : sinks_) hand_on_one_line(message, sink.get());
}

void RateLimitedSink::flush_() {
  for (const spdlog::sink_ptr& sink : sinks_) sink->flush();
}

}  // namespace farpoint::daemon
