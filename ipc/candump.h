// SPDX-License-Identifier: Apache-2.0
// CAN logs in the format of `candump -L`: "(seconds.micros) interface ID#HEXDATA", CAN FD frames with
// "ID##1HEXDATA". An identifier has 3 digits, one of 29 bits has 8.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "ipc/can_frame.h"
#include "ipc/output_file.h"

namespace farpoint::ipc {

class CandumpWriter {
 public:
  // "-" is standard output. Throws std::runtime_error naming the file where it cannot be written.
  // fd: the frames are CAN FD's, with the faster bit rate in their data.
  CandumpWriter(std::string path, std::string interface, bool fd = false);

  // One line a frame, all with this time. Precondition: utime >= 0.
  void write(std::int64_t utime, std::span<const CanFrame> frames);
  // Puts the file in its place. Throws std::runtime_error where anything was not stored (disk full).
  void close() { file_.close(); }

 private:
  OutputFile file_;
  std::string interface_;
  const char* separator_;  // between identifier and data
};

struct CandumpLine {
  std::int64_t utime = 0;
  std::string_view interface;  // within the parsed line
  CanFrame frame;
};
// False where the line is neither a classic frame nor one of CAN FD.
[[nodiscard]] bool parse_candump_line(std::string_view line, CandumpLine* out);

}  // namespace farpoint::ipc
