// SPDX-License-Identifier: Apache-2.0
// Turns frames into LCM messages and hands each, encoded once, to every message sink.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "daemon/output/message_sink.h"
#include "daemon/output/messages.h"
#include "daemon/output/pose_sink.h"
#include "ipc/channels.h"

namespace farpoint::daemon {

class Publisher final : public PoseSink {
 public:
  // Room for every message of a frame.
  Publisher() { bytes_.reserve(std::size_t{1} << 16); }
  void add(std::unique_ptr<MessageSink> sink) { sinks_.push_back(std::move(sink)); }
  [[nodiscard]] bool has_sinks() const { return !sinks_.empty(); }
  [[nodiscard]] bool has_logs() const;

  // FARPOINT_ODOMETRY first: it is what a controller waits for. Then POSE, MAP_FROM_ODOM and the viewers'
  // pose.
  void on_frame(const FrameOutput& frame) override;

  template <typename Message>
  void publish(const char* channel, std::int64_t utime, const Message& message) {
    if (sinks_.empty()) return;
    ipc::encode(message, &bytes_);
    for (const auto& sink : sinks_) sink->send(channel, utime, bytes_);
  }
  // The same for bytes that are encoded already.
  void publish_encoded(const char* channel, std::int64_t utime, std::span<const std::uint8_t> bytes) {
    for (const auto& sink : sinks_) sink->send(channel, utime, bytes);
  }
  // Results of a whole run: into logs only.
  template <typename Message>
  void publish_result(const char* channel, std::int64_t utime, const Message& message) {
    if (!has_logs()) return;
    ipc::encode(message, &bytes_);
    for (const auto& sink : sinks_) {
      if (sink->is_log()) sink->send(channel, utime, bytes_);
    }
  }

  // Messages that could not be sent or stored so far.
  [[nodiscard]] std::uint64_t log_errors() const { return errors(true); }
  [[nodiscard]] std::uint64_t network_errors() const { return errors(false); }

 private:
  [[nodiscard]] std::uint64_t errors(bool of_logs) const;

  std::vector<std::unique_ptr<MessageSink>> sinks_;
  std::vector<std::uint8_t> bytes_;  // keeps its capacity from message to message
};

}  // namespace farpoint::daemon
