// SPDX-License-Identifier: Apache-2.0
// What the kernel says of a network interface: its state, its transmit queue, and a CAN controller's bit
// rate.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace farpoint::drivers {

struct LinkInfo {
  std::uint32_t txqueuelen = 0;  // frames
  std::string queue;             // discipline: pfifo_fast, fq_codel, noqueue, ...
  std::string kind;              // can, vcan, ...; empty where the driver names none
  bool is_can = false, is_up = false;
  std::uint32_t mtu = 0;      // bytes; of an interface with CAN FD 72
  std::uint32_t bitrate = 0;  // bit/s; 0: none is set, or no controller
};
// By netlink. None where there is no such interface or no netlink.
[[nodiscard]] std::optional<LinkInfo> read_link(const std::string& interface);

// Reads the kernel's answer to RTM_GETLINK. None where it is no such answer.
[[nodiscard]] std::optional<LinkInfo> parse_link(std::span<const char> answer);

// The reason why the queue does not fit epochs of `frames` frames; empty where it fits.
[[nodiscard]] std::string queue_problem(const LinkInfo& link, std::size_t frames);

}  // namespace farpoint::drivers
