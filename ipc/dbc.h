// SPDX-License-Identifier: Apache-2.0
// Signals of a DBC file, by the names of message and signal: reads a value from a CAN frame and writes one
// into it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "ipc/can_frame.h"

namespace farpoint::ipc {

struct DbcSignal {
  std::uint32_t id = 0;  // of the frame it lies in, 11 bits
  unsigned size = 8;     // bytes of that frame
  unsigned start = 0;    // in the DBC's numbering: least significant bit (Intel), most significant (Motorola)
  unsigned length = 1;   // bits
  bool is_motorola = false;  // most significant byte first
  bool is_signed = false;
  double factor = 1.0, offset = 0.0, min = 0.0, max = 0.0;  // min = max: no range given
  std::string unit;

  // Returns the physical value; NaN for another frame, one too short, or a value outside the range.
  [[nodiscard]] double value(const CanFrame& frame) const;

  // Writes the nearest value that the signal can hold, and sets the frame's identifier and size; the bits of
  // other signals stay. Returns false for a value beyond the range or the bits. NaN and an empty range change
  // nothing. Precondition: the signal comes from read_dbc_signal().
  [[nodiscard]] bool put(double physical, CanFrame* frame) const;
};

inline constexpr std::size_t kMaxDbcBytes = std::size_t{16} << 20;

// Reads one signal's description. Throws std::runtime_error with the file, the line where known, and what was
// expected; also for a file longer than kMaxDbcBytes. Multiplexed signals and extended identifiers are not
// supported.
[[nodiscard]] DbcSignal read_dbc_signal(const std::string& path, const std::string& message,
                                        const std::string& signal);
// Reads a file's text; `path` names it in errors.
[[nodiscard]] DbcSignal parse_dbc_signal(const std::string& text, const std::string& path,
                                         const std::string& message, const std::string& signal);

}  // namespace farpoint::ipc
