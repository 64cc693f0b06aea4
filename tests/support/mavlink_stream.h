// SPDX-License-Identifier: Apache-2.0
// A stream of MAVLink bytes that comes in pieces.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <vector>

#include "ipc/mavlink/frame.h"

namespace farpoint::test {

// All messages that come out. Throws std::logic_error where a parser without a whole message has no room.
inline std::vector<ipc::mavlink::Received> parsed(ipc::mavlink::Parser* parser,
                                                  std::span<const std::uint8_t> bytes, std::size_t piece) {
  std::vector<ipc::mavlink::Received> all;
  while (!bytes.empty()) {
    const std::size_t taken = parser->take(bytes.first(std::min(piece, bytes.size())));
    if (taken == 0) throw std::logic_error("a parser without a whole message has no room");
    bytes = bytes.subspan(taken);
    while (const auto received = parser->next()) all.push_back(*received);
  }
  return all;
}

}  // namespace farpoint::test
