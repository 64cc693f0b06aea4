// SPDX-License-Identifier: Apache-2.0
#include "ipc/lcm_publisher.h"

#include <stdexcept>

namespace farpoint::ipc {

LcmPublisher::LcmPublisher(const std::string& url, std::size_t buffer_bytes) : buffer_(buffer_bytes) {
  lcm_ = lcm_create(url.c_str());
  if (lcm_ != nullptr) return;
  const bool is_udp = url.empty() || url.starts_with("udpm://");
  throw std::runtime_error(
      "cannot publish on '" + url + "': " +
      (is_udp ? "no route to the multicast group (for one host: ip route add 239.255.76.67/32 dev lo)"
              : "expected an LCM URL such as udpm://239.255.76.67:7667?ttl=0"));
}

LcmPublisher::~LcmPublisher() {
  lcm_destroy(lcm_);
}

bool LcmPublisher::send(const char* channel, std::span<const std::uint8_t> bytes) {
  const bool sent = lcm_publish(lcm_, channel, bytes.data(), static_cast<unsigned>(bytes.size())) == 0;
  ++(sent ? counts_.sent : counts_.failed);
  return sent;
}

}  // namespace farpoint::ipc
