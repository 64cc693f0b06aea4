// SPDX-License-Identifier: Apache-2.0
#include "ipc/candump.h"

#include <algorithm>
#include <charconv>
#include <cinttypes>
#include <cstdio>
#include <utility>

namespace farpoint::ipc {
namespace {

constexpr std::int64_t kMicrosPerSecond = 1'000'000;
constexpr std::size_t kMicrosDigits = 6;
constexpr std::size_t kMaxClassicBytes = 8, kMaxFdBytes = 64;
constexpr std::size_t kStandardDigits = 3, kExtendedDigits = 8;

// All of the text as a number, else false.
template <typename Number>
bool parse_number(std::string_view text, int base, Number* out) {
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, *out, base);
  return error == std::errc{} && stop == end && text.front() != '-';
}

bool parse_time(std::string_view text, std::int64_t* utime) {
  const std::size_t dot = text.find('.');
  if (dot == std::string_view::npos || text.size() - dot - 1 != kMicrosDigits) return false;
  std::int64_t seconds = 0, micros = 0;
  if (!parse_number(text.substr(0, dot), 10, &seconds) || !parse_number(text.substr(dot + 1), 10, &micros))
    return false;
  if (seconds > INT64_MAX / kMicrosPerSecond - 1) return false;
  *utime = seconds * kMicrosPerSecond + micros;
  return true;
}

// The data behind the sign of their kind; *most: bytes that this kind can have.
std::string_view data_of(std::string_view text, std::size_t hash, std::size_t* most) {
  const bool fd = text.substr(hash).starts_with("##");
  *most = fd ? kMaxFdBytes : kMaxClassicBytes;
  constexpr std::size_t kFlags = 1;  // a digit
  return text.substr(std::min(text.size(), hash + (fd ? 2 + kFlags : 1)));
}

bool parse_frame(std::string_view text, CanFrame* frame) {
  const std::size_t hash = text.find('#');
  if (hash != kStandardDigits && hash != kExtendedDigits) return false;
  frame->extended = hash == kExtendedDigits;
  const std::uint32_t most_id = frame->extended ? kMaxExtendedCanId : kMaxStandardCanId;
  if (!parse_number(text.substr(0, hash), 16, &frame->id) || frame->id > most_id) return false;
  if (text.ends_with("##")) return false;  // no flags
  std::size_t most = 0;
  const std::string_view bytes = data_of(text, hash, &most);
  if (bytes.size() % 2 != 0 || bytes.size() / 2 > most) return false;
  frame->size = static_cast<std::uint8_t>(bytes.size() / 2);
  frame->data.fill(0);
  for (std::size_t i = 0; i < frame->size; ++i) {
    if (!parse_number(bytes.substr(2 * i, 2), 16, &frame->data[i])) return false;
  }
  return true;
}

}  // namespace

CandumpWriter::CandumpWriter(std::string path, std::string interface, bool fd)
    : file_(std::move(path)), interface_(std::move(interface)), separator_(fd ? "##1" : "#") {}

void CandumpWriter::write(std::int64_t utime, std::span<const CanFrame> frames) {
  for (const CanFrame& frame : frames) {
    std::fprintf(file_.stream(), "(%010" PRId64 ".%06" PRId64 ") %s %0*" PRIX32 "%s",
                 utime / kMicrosPerSecond, utime % kMicrosPerSecond, interface_.c_str(),
                 static_cast<int>(frame.extended ? kExtendedDigits : kStandardDigits), frame.id, separator_);
    for (std::size_t i = 0; i < frame.size; ++i) std::fprintf(file_.stream(), "%02X", frame.data[i]);
    std::fputc('\n', file_.stream());
  }
}

bool parse_candump_line(std::string_view line, CandumpLine* out) {
  while (!line.empty() && (line.back() == '\n' || line.back() == '\r')) line.remove_suffix(1);
  const std::size_t time_end = line.find(") ");
  if (line.empty() || line.front() != '(' || time_end == std::string_view::npos || time_end < 2) return false;
  if (!parse_time(line.substr(1, time_end - 1), &out->utime)) return false;
  const std::string_view rest = line.substr(time_end + 2);
  const std::size_t space = rest.find(' ');
  if (space == std::string_view::npos || space == 0) return false;
  out->interface = rest.substr(0, space);
  return parse_frame(rest.substr(space + 1), &out->frame);
}

}  // namespace farpoint::ipc
