// SPDX-License-Identifier: Apache-2.0
#include "drivers/can/link_info.h"

#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstring>

namespace farpoint::drivers {
namespace {

struct Request {
  nlmsghdr head{};
  ifinfomsg link{};
};

// The kernel answers at once; it needs no second message for one interface.
std::size_t ask(int fd, int index, char* answer, std::size_t room) {
  Request request;
  request.head.nlmsg_len = sizeof request;
  request.head.nlmsg_type = RTM_GETLINK;
  request.head.nlmsg_flags = NLM_F_REQUEST;
  request.link.ifi_family = AF_UNSPEC;
  request.link.ifi_index = index;
  if (send(fd, &request, sizeof request, 0) != static_cast<ssize_t>(sizeof request)) return 0;
  const ssize_t got = recv(fd, answer, room, 0);
  return got > 0 ? static_cast<std::size_t>(got) : 0;
}

std::optional<LinkInfo> parse(const char* answer, std::size_t bytes) {
  const auto* head = reinterpret_cast<const nlmsghdr*>(answer);
  if (bytes < sizeof(Request) || head->nlmsg_type != RTM_NEWLINK || head->nlmsg_len > bytes) return {};
  LinkInfo found;
  std::size_t at = NLMSG_LENGTH(sizeof(ifinfomsg));
  while (at + sizeof(rtattr) <= head->nlmsg_len) {
    rtattr attribute{};
    std::memcpy(&attribute, answer + at, sizeof attribute);
    if (attribute.rta_len < sizeof attribute || at + attribute.rta_len > head->nlmsg_len) break;
    const char* data = answer + at + sizeof attribute;
    const std::size_t size = attribute.rta_len - sizeof attribute;
    if (attribute.rta_type == IFLA_TXQLEN && size >= sizeof found.txqueuelen)
      std::memcpy(&found.txqueuelen, data, sizeof found.txqueuelen);
    if (attribute.rta_type == IFLA_QDISC) found.queue.assign(data, strnlen(data, size));
    at += RTA_ALIGN(attribute.rta_len);
  }
  return found;
}

}  // namespace

std::optional<LinkInfo> read_link(const std::string& interface) {
  const unsigned index = if_nametoindex(interface.c_str());
  if (index == 0) return {};
  const int fd = socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
  if (fd < 0) return {};
  constexpr timeval kLimit{0, 200'000};
  (void)setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &kLimit, sizeof kLimit);
  alignas(nlmsghdr) std::array<char, 16384> answer{};
  const std::size_t bytes = ask(fd, static_cast<int>(index), answer.data(), answer.size());
  close(fd);
  return parse(answer.data(), bytes);
}

std::string queue_problem(const LinkInfo& link, std::size_t frames) {
  if (link.queue == "noqueue") return {};
  const bool keeps_order = link.queue.starts_with("pfifo") || link.queue == "prio" || link.queue == "mq";
  if (!keeps_order)
    return "its queue discipline is " + link.queue +
           ", which may drop or reorder frames, expected pfifo_fast or pfifo (tc qdisc replace ... root "
           "pfifo)";
  if (link.txqueuelen >= frames) return {};
  return "its transmit queue holds " + std::to_string(link.txqueuelen) + " frames, expected room for the " +
         std::to_string(frames) + " of an epoch (ip link set ... txqueuelen 64)";
}

}  // namespace farpoint::drivers
