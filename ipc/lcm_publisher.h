// SPDX-License-Identifier: Apache-2.0
// Publishes LCM messages to the network without a heap call.
//
// LCM's C++ publish() allocates a buffer for each message. This class encodes into one fixed buffer and calls
// the C function, which makes no heap call up to 200 kB (a test watches it).
#pragma once

#include <lcm/lcm.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace farpoint::ipc {

struct LcmCounts {
  std::uint64_t sent = 0;
  std::uint64_t failed = 0;     // refused by the network
  std::uint64_t too_large = 0;  // longer than the buffer; images and results of whole runs belong in logs
};

// False where a UDP URL names a group without a route; LcmPublisher cannot be made then. Sends nothing.
[[nodiscard]] bool has_route(const std::string& url);

class LcmPublisher {
 public:
  static constexpr std::size_t kDefaultBufferBytes = std::size_t{256} << 10;

  // Allocates and touches the buffer. Throws std::runtime_error naming what is missing: a multicast route or
  // a known provider. An LCM object on UDP needs a route to its group, even on loopback:
  //   ip route add 239.255.76.67/32 dev lo
  explicit LcmPublisher(const std::string& url, std::size_t buffer_bytes = kDefaultBufferBytes);
  ~LcmPublisher();
  LcmPublisher(const LcmPublisher&) = delete;
  LcmPublisher& operator=(const LcmPublisher&) = delete;

  // Sends one message; returns false if it was not sent (counted). No allocation, no exception. Precondition:
  // the message's arrays have the lengths of its counts.
  template <typename Message>
  bool publish(const char* channel, const Message& message) {
    const int size = message.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
    if (size < 0) {  // did not fit
      ++counts_.too_large;
      return false;
    }
    return send(channel, std::span(buffer_).first(static_cast<std::size_t>(size)));
  }
  // Sends encoded bytes of any length.
  bool send(const char* channel, std::span<const std::uint8_t> bytes);

  [[nodiscard]] const LcmCounts& counts() const { return counts_; }

 private:
  lcm_t* lcm_ = nullptr;
  std::vector<std::uint8_t> buffer_;
  LcmCounts counts_;
};

}  // namespace farpoint::ipc
