// SPDX-License-Identifier: Apache-2.0
#include "drivers/can/link_info.h"

#include <gtest/gtest.h>
#include <linux/can/netlink.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <net/if_arp.h>

#include <cstring>
#include <vector>

namespace farpoint::drivers {
namespace {

TEST(LinkInfo, TheKernelTellsTheQueueOfAnInterface) {
  const auto link = read_link("lo");
  if (!link) GTEST_SKIP() << "no netlink on this machine";
  EXPECT_FALSE(link->queue.empty());
  EXPECT_GT(link->txqueuelen, 0U);
  EXPECT_FALSE(read_link("nosuchlink0"));
}

// One attribute: head, data, padding.
std::string attribute(int type, const std::string& data) {
  rtattr head{};
  head.rta_len = static_cast<unsigned short>(sizeof head + data.size());
  head.rta_type = static_cast<unsigned short>(type);
  std::string bytes(reinterpret_cast<const char*>(&head), sizeof head);
  bytes += data;
  bytes.resize(RTA_ALIGN(bytes.size()), '\0');
  return bytes;
}

template <typename T>
std::string bytes_of(const T& value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

// The kernel's answer about a controller of 500 kbit/s.
std::string answer_of_a_controller() {
  can_bittiming timing{};
  timing.bitrate = 500'000;
  const std::string data = attribute(IFLA_CAN_BITTIMING, bytes_of(timing));
  const std::string attributes =
      attribute(IFLA_TXQLEN, bytes_of(std::uint32_t{10})) + attribute(IFLA_MTU, bytes_of(std::uint32_t{16})) +
      attribute(IFLA_QDISC, std::string("pfifo_fast") + '\0') +
      attribute(IFLA_LINKINFO, attribute(IFLA_INFO_KIND, std::string("can") + '\0') +
                                   attribute(IFLA_INFO_DATA | NLA_F_NESTED, data));
  nlmsghdr head{};
  ifinfomsg link{};
  head.nlmsg_type = RTM_NEWLINK;
  head.nlmsg_len = static_cast<std::uint32_t>(sizeof head + sizeof link + attributes.size());
  link.ifi_type = ARPHRD_CAN;
  link.ifi_flags = IFF_UP;
  return bytes_of(head) + bytes_of(link) + attributes;
}

TEST(LinkInfo, AControllersBitRateAndStateAreRead) {
  const auto link = parse_link(answer_of_a_controller());
  ASSERT_TRUE(link);
  EXPECT_TRUE(link->is_can && link->is_up);
  EXPECT_EQ(link->kind, "can");
  EXPECT_EQ(link->bitrate, 500'000U);
  EXPECT_EQ(link->mtu, 16U);
  EXPECT_EQ(link->txqueuelen, 10U);
  EXPECT_EQ(link->queue, "pfifo_fast");
}

TEST(LinkInfo, ACutOrDamagedAnswerIsReadWithinItsBounds) {
  const std::string whole = answer_of_a_controller();
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(parse_link(std::vector<char>(whole.begin(), whole.begin() + static_cast<long>(size))));
  for (std::size_t i = sizeof(nlmsghdr) + sizeof(ifinfomsg); i < whole.size(); ++i) {
    std::vector<char> damaged(whole.begin(), whole.end());
    damaged[i] = static_cast<char>(0xFF);
    (void)parse_link(damaged);  // the address sanitizer watches
  }
}

LinkInfo link_of(std::uint32_t txqueuelen, const std::string& queue) {
  LinkInfo link;
  link.txqueuelen = txqueuelen;
  link.queue = queue;
  return link;
}

TEST(LinkInfo, AQueueThatDoesNotFitAnEpochIsSaid) {
  EXPECT_EQ(queue_problem(link_of(10, "pfifo_fast"), 9), "");
  EXPECT_EQ(queue_problem(link_of(0, "noqueue"), 9), "");  // vcan
  EXPECT_NE(queue_problem(link_of(8, "pfifo_fast"), 9).find("holds 8 frames, expected room for the 9"),
            std::string::npos);
  EXPECT_NE(queue_problem(link_of(1000, "fq_codel"), 9).find("is fq_codel, which may drop or reorder"),
            std::string::npos);
}

}  // namespace
}  // namespace farpoint::drivers
