#include "daemon/message_sink.h"

namespace farpoint::daemon {

void LogMessageSink::send(const char* channel, std::int64_t utime, std::span<const std::uint8_t> bytes) {
  if (!log_->write(channel, utime, bytes)) ++errors_;
}

std::unique_ptr<LcmMessageSink> LcmMessageSink::open(const std::string& url) {
  lcm_t* lcm = lcm_create(url.c_str());
  if (lcm == nullptr) return nullptr;
  return std::unique_ptr<LcmMessageSink>(new LcmMessageSink(lcm));
}

LcmMessageSink::~LcmMessageSink() {
  lcm_destroy(lcm_);
}

void LcmMessageSink::send(const char* channel, std::int64_t /*utime*/, std::span<const std::uint8_t> bytes) {
  const auto size = static_cast<unsigned int>(bytes.size());
  if (lcm_publish(lcm_, channel, bytes.data(), size) != 0) ++errors_;
}

}  // namespace farpoint::daemon
