// SPDX-License-Identifier: Apache-2.0
// What a run publishes, kept in memory: sinks for the tests of what hands frames over.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "daemon/output/message_sink.h"
#include "daemon/output/pose_sink.h"
#include "ipc/message.h"

namespace farpoint::test {

// Frames, in the order of their coming.
class KeptFrames final : public daemon::PoseSink {
 public:
  void on_frame(const daemon::FrameOutput& frame) override { frames.push_back(frame); }
  std::vector<daemon::FrameOutput> frames;
};

// Messages with their channels. Outlives the sinks that fill it.
struct KeptMessages {
  struct Message {
    std::string channel;
    std::int64_t utime = 0;
    std::vector<std::uint8_t> bytes;
  };
  std::vector<Message> messages;

  template <typename Type>
  [[nodiscard]] std::vector<Type> of(const std::string& channel) const {
    std::vector<Type> out;
    for (const Message& m : messages) {
      if (m.channel != channel) continue;
      out.emplace_back();
      (void)ipc::decode(m.bytes, &out.back());
    }
    return out;
  }
};

class KeptMessageSink final : public daemon::MessageSink {
 public:
  explicit KeptMessageSink(KeptMessages* kept) : kept_(*kept) {}
  void send(const char* channel, std::int64_t utime, std::span<const std::uint8_t> bytes) override {
    kept_.messages.push_back({channel, utime, {bytes.begin(), bytes.end()}});
  }
  [[nodiscard]] std::uint64_t errors() const override { return 0; }
  [[nodiscard]] bool is_log() const override { return true; }

 private:
  KeptMessages& kept_;
};

}  // namespace farpoint::test
