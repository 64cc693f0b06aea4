// Signals of a DBC file: what is needed to read a value out of a CAN frame, or put one into it, by its
// message's and its own name.
#pragma once

#include <cstdint>
#include <string>

#include "ipc/can_frame.h"

namespace farpoint::ipc {

struct DbcSignal {
  std::uint32_t id = 0;      // of the frame it lies in, 11 bits
  unsigned size = 8;         // bytes of that frame
  unsigned start = 0;        // as the DBC counts: least significant bit (Intel), most significant (Motorola)
  unsigned length = 1;       // bits
  bool is_motorola = false;  // most significant byte first
  bool is_signed = false;
  double factor = 1.0, offset = 0.0, min = 0.0, max = 0.0;  // min = max: no range given
  std::string unit;

  // The physical value. NaN where the frame is another, too short, or the value outside the range.
  [[nodiscard]] double value(const CanFrame& frame) const;

  // Puts the nearest value that the signal can hold into a frame, which becomes one of its message; the bits
  // of other signals stay. False where what is asked for is beyond the range or the bits; and where it is NaN
  // or no number is in the range, which changes nothing. Precondition: as read_dbc_signal() gives it.
  [[nodiscard]] bool put(double physical, CanFrame* frame) const;
};

// Reads one signal's description. Throws std::runtime_error naming the file, the line where there is one, and
// what was expected. Multiplexed signals and extended identifiers are not read.
[[nodiscard]] DbcSignal read_dbc_signal(const std::string& path, const std::string& message,
                                        const std::string& signal);

}  // namespace farpoint::ipc
