// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/message_sink.h"

#include <arpa/inet.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <string_view>

namespace farpoint::daemon {
namespace {

// Head of a record: the event's time, then the length of the channel's name, which follows.
struct EventHead {
  std::int64_t utime = 0;
  std::uint64_t channel_bytes = 0;
};

std::span<const std::uint8_t> bytes_of(const void* data, std::size_t size) {
  return {static_cast<const std::uint8_t*>(data), size};
}

bool is_port(std::string_view text) {
  std::uint16_t port = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), port);
  return result.ec == std::errc() && result.ptr == text.data() + text.size() && port > 0;
}

}  // namespace

void LogMessageSink::send(const char* channel, std::int64_t utime, std::span<const std::uint8_t> bytes) {
  if (!log_->write(channel, utime, bytes)) ++errors_;
}

QueuedLogSink::QueuedLogSink(FileWriter* files, const LateOpened<ipc::LogWriter>* log)
    : files_(*files),
      log_(*log),
      file_(files->add_file([this](std::span<const std::uint8_t> record) { write(record); })) {}

void QueuedLogSink::send(const char* channel, std::int64_t utime, std::span<const std::uint8_t> bytes) {
  const EventHead head{utime, std::strlen(channel)};
  if (!files_.push(file_, {bytes_of(&head, sizeof head), bytes_of(channel, head.channel_bytes), bytes}))
    ++dropped_;
}

void QueuedLogSink::write(std::span<const std::uint8_t> record) {
  EventHead head;
  std::memcpy(&head, record.data(), sizeof head);
  const auto rest = record.subspan(sizeof head);
  const std::string_view channel(reinterpret_cast<const char*>(rest.data()), head.channel_bytes);
  ipc::LogWriter* log = log_.get();
  const bool stored = log != nullptr && log->write(channel, head.utime, rest.subspan(head.channel_bytes));
  if (!stored) not_stored_.fetch_add(1, std::memory_order_relaxed);
}

void LcmMessageSink::send(const char* channel, std::int64_t /*utime*/, std::span<const std::uint8_t> bytes) {
  if (ipc::LcmPublisher* publisher = publisher_.get())
    publisher->send(channel, bytes);
  else
    ++dropped_;
}

std::uint64_t LcmMessageSink::errors() const {
  const ipc::LcmPublisher* publisher = publisher_.get();
  return dropped_ + (publisher != nullptr ? publisher->counts().failed : 0);
}

std::string lcm_url_problem(const std::string& url) {
  constexpr std::array kProviders = {"udpm", "tcpq", "file", "memq"};
  const std::size_t end = url.find("://");
  const std::string provider = url.substr(0, end);
  const bool known = end != std::string::npos &&
                     std::find(kProviders.begin(), kProviders.end(), provider) != kProviders.end();
  if (!known) return "expected an LCM URL such as udpm://239.255.76.67:7667?ttl=0";
  const std::string rest = url.substr(end + 3);
  const std::string network = rest.substr(0, rest.find('?'));
  if (provider != "udpm" || network.empty()) return {};
  const std::size_t colon = network.find(':');
  in_addr address{};
  const bool has_address = inet_pton(AF_INET, network.substr(0, colon).c_str(), &address) == 1;
  const bool has_port = colon == std::string::npos || is_port(network.substr(colon + 1));
  return has_address && has_port ? "" : "expected a group and a port such as 239.255.76.67:7667";
}

}  // namespace farpoint::daemon
