// SPDX-License-Identifier: Apache-2.0
#include "ipc/printable.h"

#include <cstdint>

namespace farpoint::ipc {
namespace {

constexpr std::string_view kCut = "...";

std::uint8_t byte_of(std::string_view text, std::size_t at) {
  return static_cast<std::uint8_t>(text[at]);
}

// Bytes of the printable character at the front of a text that is not empty; 0 for what is to be escaped.
std::size_t printable_character(std::string_view text) {
  const std::uint8_t first = byte_of(text, 0);
  if (first < 0x80) return first >= 0x20 && first != 0x7f ? 1 : 0;
  const std::size_t bytes = first >= 0xf0 && first <= 0xf4   ? 4
                            : first >= 0xe0 && first <= 0xef ? 3
                            : first >= 0xc2 && first <= 0xdf ? 2
                                                             : 0;
  if (bytes == 0 || text.size() < bytes) return 0;
  for (std::size_t i = 1; i < bytes; ++i)
    if ((byte_of(text, i) & 0xc0) != 0x80) return 0;
  const std::uint8_t second = byte_of(text, 1);
  const bool is_control = first == 0xc2 && second < 0xa0;
  const bool is_overlong = (first == 0xe0 && second < 0xa0) || (first == 0xf0 && second < 0x90);
  const bool is_no_character = (first == 0xed && second >= 0xa0) || (first == 0xf4 && second >= 0x90);
  // U+2028 and U+2029 end lines too.
  const bool is_separator =
      first == 0xe2 && second == 0x80 && (byte_of(text, 2) == 0xa8 || byte_of(text, 2) == 0xa9);
  return is_control || is_overlong || is_no_character || is_separator ? 0 : bytes;
}

std::string escaped_byte(std::uint8_t byte) {
  constexpr char kDigits[] = "0123456789abcdef";
  switch (byte) {
    case '\n':
      return "\\n";
    case '\r':
      return "\\r";
    case '\t':
      return "\\t";
    default:
      return {'\\', 'x', kDigits[byte >> 4], kDigits[byte & 0xf]};
  }
}

}  // namespace

bool is_printable_line(std::string_view text) {
  if (text.size() > kMaxLineBytes) return false;
  while (!text.empty()) {
    const std::size_t bytes = printable_character(text);
    if (bytes == 0) return false;
    text.remove_prefix(bytes);
  }
  return true;
}

std::string printable(std::string_view text, std::size_t most_bytes) {
  std::string line;
  std::size_t cut_at = 0;  // the most that leaves room for kCut
  while (!text.empty()) {
    const std::size_t bytes = printable_character(text);
    const std::string piece = bytes > 0 ? std::string(text.substr(0, bytes)) : escaped_byte(byte_of(text, 0));
    text.remove_prefix(bytes > 0 ? bytes : 1);
    if (line.size() + piece.size() > most_bytes) return line.substr(0, cut_at).append(kCut);
    line += piece;
    if (line.size() + kCut.size() <= most_bytes) cut_at = line.size();
  }
  return line;
}

}  // namespace farpoint::ipc
