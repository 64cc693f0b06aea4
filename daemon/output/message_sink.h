// SPDX-License-Identifier: Apache-2.0
// Where encoded LCM messages go.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "ipc/lcm_publisher.h"
#include "ipc/log.h"

namespace farpoint::daemon {

// One way out for LCM messages. Errors are counted, never thrown.
class MessageSink {
 public:
  virtual ~MessageSink() = default;
  virtual void send(const char* channel, std::int64_t utime, std::span<const std::uint8_t> bytes) = 0;
  [[nodiscard]] virtual std::uint64_t errors() const = 0;
  // Logs also keep the results of a whole run, which are too long for the network.
  [[nodiscard]] virtual bool is_log() const = 0;
};

// Into a log; the event's time is the message's utime.
class LogMessageSink final : public MessageSink {
 public:
  // The log must outlive the sink.
  explicit LogMessageSink(ipc::LogWriter* log) : log_(log) {}
  void send(const char* channel, std::int64_t utime, std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] std::uint64_t errors() const override { return errors_; }
  [[nodiscard]] bool is_log() const override { return true; }

 private:
  ipc::LogWriter* log_;
  std::uint64_t errors_ = 0;
};

// Onto the network through LCM.
class LcmMessageSink final : public MessageSink {
 public:
  // Throws std::runtime_error saying what the URL lacks (a multicast route, a known provider).
  explicit LcmMessageSink(const std::string& url) : publisher_(url) {}

  void send(const char* channel, std::int64_t utime, std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] std::uint64_t errors() const override { return publisher_.counts().failed; }
  [[nodiscard]] bool is_log() const override { return false; }

 private:
  ipc::LcmPublisher publisher_;
};

}  // namespace farpoint::daemon
