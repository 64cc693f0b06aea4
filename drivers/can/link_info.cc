// SPDX-License-Identifier: Apache-2.0
#include "drivers/can/link_info.h"

#include <linux/can/netlink.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
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

// Calls take(type, data) for each attribute; stops at a damaged one.
template <typename Take>
void walk_attributes(std::span<const char> attributes, const Take& take) {
  while (attributes.size() >= sizeof(rtattr)) {
    rtattr attribute{};
    std::memcpy(&attribute, attributes.data(), sizeof attribute);
    if (attribute.rta_len < sizeof attribute || attribute.rta_len > attributes.size()) return;
    take(attribute.rta_type & NLA_TYPE_MASK,
         attributes.subspan(sizeof attribute, attribute.rta_len - sizeof attribute));
    attributes = attributes.subspan(std::min<std::size_t>(RTA_ALIGN(attribute.rta_len), attributes.size()));
  }
}

std::string text_of(std::span<const char> data) {
  return {data.data(), strnlen(data.data(), data.size())};
}

void take_number(std::span<const char> data, std::uint32_t* number) {
  if (data.size() >= sizeof *number) std::memcpy(number, data.data(), sizeof *number);
}

// The first member of can_bittiming is the bit rate.
void take_link_kind(std::span<const char> attributes, LinkInfo* link) {
  walk_attributes(attributes, [&](int type, std::span<const char> data) {
    if (type == IFLA_INFO_KIND) link->kind = text_of(data);
    if (type != IFLA_INFO_DATA || link->kind != "can") return;
    walk_attributes(data, [&](int inner, std::span<const char> timing) {
      if (inner == IFLA_CAN_BITTIMING) take_number(timing, &link->bitrate);
    });
  });
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
  return parse_link({answer.data(), bytes});
}

std::optional<LinkInfo> parse_link(std::span<const char> answer) {
  Request head;
  if (answer.size() < sizeof head) return {};
  std::memcpy(&head, answer.data(), sizeof head);
  if (head.head.nlmsg_type != RTM_NEWLINK || head.head.nlmsg_len < sizeof head ||
      head.head.nlmsg_len > answer.size())
    return {};
  LinkInfo found;
  found.is_can = head.link.ifi_type == ARPHRD_CAN;
  found.is_up = (head.link.ifi_flags & IFF_UP) != 0;
  walk_attributes(answer.first(head.head.nlmsg_len).subspan(sizeof head),
                  [&](int type, std::span<const char> data) {
                    if (type == IFLA_TXQLEN) take_number(data, &found.txqueuelen);
                    if (type == IFLA_MTU) take_number(data, &found.mtu);
                    if (type == IFLA_QDISC) found.queue = text_of(data);
                    if (type == IFLA_LINKINFO) take_link_kind(data, &found);
                  });
  return found;
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
