// SPDX-License-Identifier: Apache-2.0
#include "ipc/lcm_publisher.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <stdexcept>
#include <string_view>

namespace farpoint::ipc {

// LCM itself writes a page to standard error where there is no route.
bool has_route(const std::string& url) {
  constexpr std::string_view kUdp = "udpm://", kDefaultGroup = "239.255.76.67";
  if (!url.starts_with(kUdp)) return true;
  const std::string named = url.substr(kUdp.size(), url.find_first_of(":?", kUdp.size()) - kUdp.size());
  sockaddr_in group{};
  group.sin_family = AF_INET;
  group.sin_port = htons(7667);
  const std::string address = named.empty() ? std::string(kDefaultGroup) : named;
  if (inet_pton(AF_INET, address.c_str(), &group.sin_addr) != 1) return true;
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return true;
  const bool has = connect(fd, reinterpret_cast<const sockaddr*>(&group), sizeof group) == 0;
  close(fd);
  return has;
}

LcmPublisher::LcmPublisher(const std::string& url, std::size_t buffer_bytes) : buffer_(buffer_bytes) {
  if (has_route(url)) lcm_ = lcm_create(url.c_str());
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
