// SPDX-License-Identifier: Apache-2.0
#include "ipc/mavlink/frame.h"

#include <algorithm>
#include <cassert>
#include <cstring>

namespace farpoint::ipc::mavlink {
namespace {

constexpr std::uint8_t kMagic1 = 0xFE, kMagic2 = 0xFD;
constexpr std::size_t kHead1 = 6, kHead2 = 10, kChecksumBytes = 2, kSignatureBytes = 13;
constexpr std::uint8_t kIsSigned = 0x01;
constexpr std::array kKnown = {kHeartbeat, kTimesync, kOdometry};

bool is_magic(std::uint8_t byte) {
  return byte == kMagic1 || byte == kMagic2;
}

// CRC-16/MCRF4XX, polynomial 0x1021 reflected, start 0xFFFF.
class Checksum {
 public:
  void add(std::uint8_t byte) {
    crc_ = static_cast<std::uint16_t>(crc_ ^ byte);
    for (int bit = 0; bit < 8; ++bit)
      crc_ = static_cast<std::uint16_t>((crc_ & 1) != 0 ? (crc_ >> 1) ^ 0x8408 : crc_ >> 1);
  }
  void add(std::span<const std::uint8_t> bytes) {
    for (const std::uint8_t byte : bytes) add(byte);
  }
  [[nodiscard]] std::uint16_t value() const { return crc_; }

 private:
  std::uint16_t crc_ = 0xFFFF;
};

// Of the bytes behind the magic one.
std::uint16_t checksum(std::span<const std::uint8_t> head_and_payload, std::uint8_t crc_extra) {
  Checksum sum;
  sum.add(head_and_payload);
  sum.add(crc_extra);
  return sum.value();
}

const MessageKind* find_kind(std::uint32_t id) {
  const auto* const kind =
      std::find_if(kKnown.begin(), kKnown.end(), [id](const MessageKind& k) { return k.id == id; });
  return kind == kKnown.end() ? nullptr : kind;
}

// Where the parts of a frame lie.
struct Head {
  std::size_t head = 0, payload = 0, whole = 0;  // bytes
  Received message;
};

// Nothing where the head is not whole. Precondition: the first byte is magic.
std::optional<Head> read_head(std::span<const std::uint8_t> bytes) {
  const bool second = bytes[0] == kMagic2;
  Head h;
  h.head = second ? kHead2 : kHead1;
  if (bytes.size() < h.head) return std::nullopt;
  h.payload = bytes[1];
  h.whole = h.head + h.payload + kChecksumBytes;
  if (second) {
    if ((bytes[2] & kIsSigned) != 0) h.whole += kSignatureBytes;
    h.message.sender = {bytes[5], bytes[6]};
    h.message.id = static_cast<std::uint32_t>(bytes[7]) | static_cast<std::uint32_t>(bytes[8]) << 8 |
                   static_cast<std::uint32_t>(bytes[9]) << 16;
  } else {
    h.message.sender = {bytes[3], bytes[4]};
    h.message.id = bytes[5];
  }
  return h;
}

}  // namespace

Frame::Frame(const MessageKind& kind, const Sender& sender, std::uint8_t sequence,
             std::span<const std::uint8_t> payload) {
  assert(payload.size() == kind.payload_bytes);
  std::size_t length = payload.size();
  while (length > 1 && payload[length - 1] == 0) --length;
  bytes_ = {kMagic2,
            static_cast<std::uint8_t>(length),
            0,
            0,
            sequence,
            sender.system,
            sender.component,
            static_cast<std::uint8_t>(kind.id & 0xFF),
            static_cast<std::uint8_t>(kind.id >> 8 & 0xFF),
            static_cast<std::uint8_t>(kind.id >> 16 & 0xFF)};
  std::copy_n(payload.begin(), length, bytes_.begin() + kHead2);
  const std::size_t end = kHead2 + length;
  const std::uint16_t sum = checksum(std::span(bytes_).subspan(1, end - 1), kind.crc_extra);
  bytes_[end] = static_cast<std::uint8_t>(sum & 0xFF);
  bytes_[end + 1] = static_cast<std::uint8_t>(sum >> 8);
  size_ = end + kChecksumBytes;
}

std::size_t Parser::take(std::span<const std::uint8_t> bytes) {
  const std::size_t count = std::min(bytes.size(), bytes_.size() - size_);
  std::copy_n(bytes.begin(), count, bytes_.begin() + static_cast<std::ptrdiff_t>(size_));
  size_ += count;
  return count;
}

void Parser::drop(std::size_t count) {
  std::memmove(bytes_.data(), bytes_.data() + count, size_ - count);
  size_ -= count;
}

std::optional<Received> Parser::next() {
  for (;;) {
    const auto* const begin = bytes_.data();
    const auto* const magic = std::find_if(
        begin, begin + size_, [](std::uint8_t byte) { return byte == kMagic1 || byte == kMagic2; });
    drop(static_cast<std::size_t>(magic - begin));
    if (size_ == 0) return std::nullopt;
    std::optional<Head> h = read_head({bytes_.data(), size_});
    if (!h || size_ < h->whole) return std::nullopt;
    const MessageKind* kind = find_kind(h->message.id);
    if (kind == nullptr) {
      if (size_ == h->whole) return std::nullopt;  // the next byte tells
      drop(is_magic(bytes_[h->whole]) ? h->whole : 1);
      continue;
    }
    const std::size_t end = h->head + h->payload;
    const std::uint16_t sum = checksum(std::span(bytes_).subspan(1, end - 1), kind->crc_extra);
    const bool is_right = bytes_[end] == (sum & 0xFF) && bytes_[end + 1] == sum >> 8;
    if (is_right)
      std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(h->head), h->payload,
                  h->message.payload.begin());
    else
      ++damaged_;
    drop(is_right ? h->whole : 1);
    if (is_right) return h->message;
  }
}

}  // namespace farpoint::ipc::mavlink
