// SPDX-License-Identifier: Apache-2.0
// Where encoded LCM messages go.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <string>

#include "daemon/output/file_writer.h"
#include "daemon/system/late_opened.h"
#include "ipc/lcm_publisher.h"
#include "ipc/log.h"

namespace farpoint::daemon {

// One way out for LCM messages. Errors are counted, never thrown.
class MessageSink {
 public:
  virtual ~MessageSink() = default;
  virtual void send(const char* channel, std::int64_t utime, std::span<const std::uint8_t> bytes) = 0;
  // Messages not sent or not stored. The sending thread, or any after its end.
  [[nodiscard]] virtual std::uint64_t errors() const = 0;
  // Logs also keep the results of a whole run, which are too long for the network.
  [[nodiscard]] virtual bool is_log() const = 0;
};

// Into a log, at once; the event's time is the message's utime.
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

// The same on the thread of a FileWriter; the sending thread never waits for the disk.
class QueuedLogSink final : public MessageSink {
 public:
  // Before the writer starts. Both must outlive the writer's thread. While the log is not open, messages are
  // dropped and counted.
  QueuedLogSink(FileWriter* files, const LateOpened<ipc::LogWriter>* log);
  void send(const char* channel, std::int64_t utime, std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] std::uint64_t errors() const override {
    return dropped_ + not_stored_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] bool is_log() const override { return true; }

 private:
  void write(std::span<const std::uint8_t> record);

  FileWriter& files_;
  const LateOpened<ipc::LogWriter>& log_;
  const std::uint32_t file_;
  std::uint64_t dropped_ = 0;
  std::atomic<std::uint64_t> not_stored_{0};
};

// Onto the network through LCM.
class LcmMessageSink final : public MessageSink {
 public:
  // Not open: messages are dropped and counted.
  LcmMessageSink() = default;
  explicit LcmMessageSink(const std::string& url) { open(url); }
  // Once, any thread. Throws std::runtime_error naming what the URL lacks: a multicast route, a known
  // provider.
  void open(const std::string& url) { publisher_.set(std::make_unique<ipc::LcmPublisher>(url)); }

  void send(const char* channel, std::int64_t utime, std::span<const std::uint8_t> bytes) override;
  [[nodiscard]] std::uint64_t errors() const override;
  [[nodiscard]] bool is_log() const override { return false; }

 private:
  LateOpened<ipc::LcmPublisher> publisher_;
  std::uint64_t dropped_ = 0;
};

// Why no network can ever make this LCM URL work; empty where one may.
[[nodiscard]] std::string lcm_url_problem(const std::string& url);

}  // namespace farpoint::daemon
