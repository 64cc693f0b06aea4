#include "ipc/candump.h"

#include <charconv>
#include <cinttypes>
#include <cstdio>
#include <utility>

namespace farpoint::ipc {
namespace {

constexpr std::int64_t kMicrosPerSecond = 1'000'000;
constexpr std::size_t kMicrosDigits = 6;
constexpr std::uint32_t kMaxId = 0x7ff;
constexpr std::size_t kMaxClassicBytes = 8;

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

bool parse_frame(std::string_view text, CanFrame* frame) {
  const std::size_t hash = text.find('#');
  if (hash != 3) return false;  // 8 digits are an extended identifier
  const std::string_view bytes = text.substr(hash + 1);
  if (!parse_number(text.substr(0, hash), 16, &frame->id) || frame->id > kMaxId) return false;
  if (bytes.size() % 2 != 0 || bytes.size() / 2 > kMaxClassicBytes) return false;
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
    std::fprintf(file_.stream(), "(%010" PRId64 ".%06" PRId64 ") %s %03" PRIX32 "%s",
                 utime / kMicrosPerSecond, utime % kMicrosPerSecond, interface_.c_str(), frame.id,
                 separator_);
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
