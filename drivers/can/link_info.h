// SPDX-License-Identifier: Apache-2.0
// What the kernel says of a network interface's transmit queue.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace farpoint::drivers {

struct LinkInfo {
  std::uint32_t txqueuelen = 0;  // frames
  std::string queue;             // discipline: pfifo_fast, fq_codel, noqueue, ...
};
// By netlink. None where there is no such interface or no netlink.
[[nodiscard]] std::optional<LinkInfo> read_link(const std::string& interface);

// The reason why the queue does not fit epochs of `frames` frames; empty where it fits.
[[nodiscard]] std::string queue_problem(const LinkInfo& link, std::size_t frames);

}  // namespace farpoint::drivers
