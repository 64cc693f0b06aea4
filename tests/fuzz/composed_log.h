// SPDX-License-Identifier: Apache-2.0
// LCM logs out of fuzzed bytes. A raw input is the log itself. A composed one is a list of events, and this
// code adds the headers and fingerprints that a fuzzer would spend its time on.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "ipc/message.h"
#include "tests/fuzz/targets.h"

namespace farpoint::fuzz {

// The log of an input: first byte 'R' for raw bytes, else composed.
[[nodiscard]] Bytes log_of(ByteView input);

// Builds a composed input, event by event.
class EventList {
 public:
  template <typename Message>
  void add(std::string_view channel, const Message& message) {
    Bytes encoded;
    ipc::encode(message, &encoded);
    add_bytes(channel, encoded);
  }
  [[nodiscard]] const Bytes& input() const { return input_; }

 private:
  void add_bytes(std::string_view channel, ByteView encoded);
  Bytes input_ = {'C'};
};

}  // namespace farpoint::fuzz
