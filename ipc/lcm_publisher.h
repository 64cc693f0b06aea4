// LCM messages onto the network without touching the heap.
//
// LCM's C++ publish() allocates a buffer a message; this encodes into one that is allocated once and calls
// the raw function, which was seen to make no heap call up to 200 kB (a test watches it).
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
  std::uint64_t failed = 0;     // the network did not take it
  std::uint64_t too_large = 0;  // longer than the buffer: images and results of whole runs belong into logs
};

class LcmPublisher {
 public:
  static constexpr std::size_t kDefaultBufferBytes = std::size_t{256} << 10;

  // Throws std::runtime_error saying what the URL lacks (a multicast route, a known provider). The buffer is
  // allocated and touched here. Creating an LCM object on UDP needs a route to its group, even on loopback:
  //   ip route add 224.0.0.0/4 dev lo
  explicit LcmPublisher(const std::string& url, std::size_t buffer_bytes = kDefaultBufferBytes);
  ~LcmPublisher();
  LcmPublisher(const LcmPublisher&) = delete;
  LcmPublisher& operator=(const LcmPublisher&) = delete;

  // Sends one message; false where it was not sent (counted). No allocation, does not throw. Precondition:
  // the message's arrays are as long as its counts say.
  template <typename Message>
  bool publish(const char* channel, const Message& message) {
    const int size = message.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
    if (size < 0) {  // did not fit
      ++counts_.too_large;
      return false;
    }
    return send(channel, std::span(buffer_).first(static_cast<std::size_t>(size)));
  }
  // The same for bytes that are encoded already; their length is not limited by the buffer.
  bool send(const char* channel, std::span<const std::uint8_t> bytes);

  [[nodiscard]] const LcmCounts& counts() const { return counts_; }

 private:
  lcm_t* lcm_ = nullptr;
  std::vector<std::uint8_t> buffer_;
  LcmCounts counts_;
};

}  // namespace farpoint::ipc
