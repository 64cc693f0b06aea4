// SPDX-License-Identifier: Apache-2.0
// A small DBC reader for tests: messages, signals, value tables and the E2EDataId attribute. It shares
// nothing with the codec.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "ipc/can_frame.h"

namespace farpoint::test {

struct DbcSignal {
  unsigned start = 0, length = 0;
  bool is_signed = false;
  double factor = 1, offset = 0, min = 0, max = 0;
  std::string unit;
  std::map<std::int64_t, std::string> values;
  std::int64_t at_start = 0;

  [[nodiscard]] std::int64_t raw(const ipc::CanFrame& frame) const;
  // The physical value; NaN where the value table calls the raw value 'not available'.
  [[nodiscard]] double value(const ipc::CanFrame& frame) const;
};

struct DbcMessage {
  std::string name;
  unsigned size = 0;
  int data_id = -1, e2e_profile = -1, cycle_ms = -1, timeout_ms = -1, frame_format = -1;
  std::map<std::string, DbcSignal> signals;
};

// The identifier as the file has it: bit 31 is set where it has 29 bits.
[[nodiscard]] std::uint32_t dbc_id(const ipc::CanFrame& frame);

// By identifier. Adds a test failure for a line it cannot read.
std::map<std::uint32_t, DbcMessage> read_dbc(const std::string& path);

}  // namespace farpoint::test
