// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/message_sink.h"

namespace farpoint::daemon {

void LogMessageSink::send(const char* channel, std::int64_t utime, std::span<const std::uint8_t> bytes) {
  if (!log_->write(channel, utime, bytes)) ++errors_;
}

void LcmMessageSink::send(const char* channel, std::int64_t /*utime*/, std::span<const std::uint8_t> bytes) {
  publisher_.send(channel, bytes);
}

}  // namespace farpoint::daemon
