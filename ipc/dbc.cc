// SPDX-License-Identifier: Apache-2.0
#include "ipc/dbc.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string_view>

namespace farpoint::ipc {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint32_t kMaxStandardId = 0x7ff;
constexpr unsigned kMaxFrameBytes = std::tuple_size_v<decltype(CanFrame::data)>;  // CAN FD's

// Takes a line apart from its front.
class Scanner {
 public:
  explicit Scanner(std::string_view text) : rest_(text) {}

  [[nodiscard]] bool accept(char c) {
    skip_blanks();
    if (rest_.empty() || rest_.front() != c) return false;
    rest_.remove_prefix(1);
    return true;
  }
  // Letters, digits and underscores.
  [[nodiscard]] std::string_view word() {
    skip_blanks();
    std::size_t end = 0;
    while (end < rest_.size() && (std::isalnum(static_cast<unsigned char>(rest_[end])) || rest_[end] == '_'))
      ++end;
    return take(end);
  }
  template <typename T>
  [[nodiscard]] bool number(T* value) {
    skip_blanks();
    if (rest_.starts_with('+')) rest_.remove_prefix(1);
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), *value);
    if (error != std::errc()) return false;
    rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
    return true;
  }
  [[nodiscard]] std::string_view up_to(char c) { return take(std::min(rest_.find(c), rest_.size())); }

 private:
  std::string_view take(std::size_t n) {
    const std::string_view taken = rest_.substr(0, n);
    rest_.remove_prefix(n);
    return taken;
  }
  void skip_blanks() {
    while (!rest_.empty() && (rest_.front() == ' ' || rest_.front() == '\t')) rest_.remove_prefix(1);
  }
  std::string_view rest_;
};

// "BO_ 291 Wheels: 8 ABS": true where the line is this message.
bool read_message(std::string_view line, const std::string& name, DbcSignal* signal) {
  Scanner s(line);
  if (s.word() != "BO_") return false;
  return s.number(&signal->id) && s.word() == name && s.accept(':') && s.number(&signal->size);
}

// " SG_ Speed : 7|16@0+ (0.01,0) [0|655] "km/h" Receiver", behind the name.
bool read_layout(Scanner s, DbcSignal* d) {
  unsigned order = 2;
  if (!s.accept(':') || !s.number(&d->start) || !s.accept('|') || !s.number(&d->length) || !s.accept('@') ||
      !s.number(&order) || order > 1)
    return false;
  d->is_motorola = order == 0;
  d->is_signed = s.accept('-');
  if (!d->is_signed && !s.accept('+')) return false;
  const bool scaled =
      s.accept('(') && s.number(&d->factor) && s.accept(',') && s.number(&d->offset) && s.accept(')');
  const bool ranged =
      scaled && s.accept('[') && s.number(&d->min) && s.accept('|') && s.number(&d->max) && s.accept(']');
  if (!ranged || !s.accept('"')) return false;
  d->unit = std::string(s.up_to('"'));
  return true;
}

// The bit of the frame that holds bit i of the value, 0 the least significant.
unsigned position_of(const DbcSignal& d, unsigned i) {
  if (!d.is_motorola) return d.start + i;
  // Motorola: from the most significant bit on, downwards within a byte, then on with the next byte's bit 7.
  const unsigned from_top = d.length - 1 - i;
  const unsigned in_row = 7 - d.start % 8 + from_top;  // bits behind the first byte's bit 7
  return (d.start / 8 + in_row / 8) * 8 + (7 - in_row % 8);
}

struct RawLimits {
  double least = 0.0, most = 0.0;
  [[nodiscard]] bool hold(double number) const { return number >= least && number <= most; }
};
// The range of `length` bits. Above 53 bits a double does not represent every integer.
RawLimits raw_limits(const DbcSignal& d) {
  constexpr unsigned kExactBits = 53;
  const unsigned bits = d.is_signed ? d.length - 1 : d.length;
  const double beyond = std::ldexp(1.0, static_cast<int>(bits));
  const double most = bits > kExactBits ? std::nextafter(beyond, 0.0) : beyond - 1.0;
  return {d.is_signed ? -beyond : 0.0, most};
}

bool has_range(const DbcSignal& d) {
  return d.min != d.max;
}

bool in_range(const DbcSignal& d, double physical, double tolerance) {
  return !has_range(d) || (physical >= d.min - tolerance && physical <= d.max + tolerance);
}

// Of them those whose physical value lies in the signal's range. None: least > most.
RawLimits limits_in_range(const DbcSignal& d, const RawLimits& bits) {
  if (!has_range(d)) return bits;
  constexpr double kRounding = 1e-6;  // of a step: what (max - offset) / factor may miss a whole number by
  const double at_min = (d.min - d.offset) / d.factor, at_max = (d.max - d.offset) / d.factor;
  return {std::max(bits.least, std::ceil(std::min(at_min, at_max) - kRounding)),
          std::min(bits.most, std::floor(std::max(at_min, at_max) + kRounding))};
}

bool is_scaled_soundly(const DbcSignal& d) {
  return std::isfinite(d.factor) && d.factor != 0.0 && std::isfinite(d.offset) && std::isfinite(d.min) &&
         std::isfinite(d.max) && d.min <= d.max;
}

bool fits(const DbcSignal& d) {
  if (d.length == 0 || d.length > 64 || d.start >= 8 * d.size) return false;
  for (unsigned i = 0; i < d.length; ++i)
    if (position_of(d, i) >= 8 * d.size) return false;
  return true;
}

}  // namespace

double DbcSignal::value(const CanFrame& frame) const {
  if (frame.id != id || frame.size < size || length == 0) return kNan;
  std::uint64_t raw = 0;
  for (unsigned i = 0; i < length; ++i) {
    const unsigned bit = position_of(*this, i);
    if ((frame.data.at(bit / 8) >> (bit % 8) & 1) != 0) raw |= std::uint64_t{1} << i;
  }
  double number = static_cast<double>(raw);
  if (is_signed && (raw >> (length - 1) & 1) != 0) {
    const std::uint64_t ones = length == 64 ? 0 : ~std::uint64_t{0} << length;
    number = static_cast<double>(static_cast<std::int64_t>(raw | ones));
  }
  const double physical = number * factor + offset;
  // A sensor says 'not available' with a value beyond its range.
  return in_range(*this, physical, 0.5 * std::abs(factor)) ? physical : kNan;
}

bool DbcSignal::put(double physical, CanFrame* frame) const {
  const RawLimits bits = raw_limits(*this), limits = limits_in_range(*this, bits);
  if (std::isnan(physical) || limits.least > limits.most) return false;
  const double wanted = std::nearbyint((physical - offset) / factor);
  const double number = std::clamp(wanted, limits.least, limits.most);
  const std::uint64_t raw = is_signed ? static_cast<std::uint64_t>(static_cast<std::int64_t>(number))
                                      : static_cast<std::uint64_t>(number);
  frame->id = id;
  frame->size = static_cast<std::uint8_t>(size);
  for (unsigned i = 0; i < length; ++i) {
    const unsigned bit = position_of(*this, i);
    std::uint8_t& byte = frame->data.at(bit / 8);
    const auto mask = static_cast<std::uint8_t>(1U << (bit % 8));
    byte = static_cast<std::uint8_t>((raw >> i & 1) != 0 ? byte | mask : byte & ~mask);
  }
  return in_range(*this, physical, 0.0) && bits.hold(wanted);
}

DbcSignal read_dbc_signal(const std::string& path, const std::string& message, const std::string& signal) {
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw std::runtime_error(path + ": cannot be opened (" + std::strerror(errno) + "), expected a DBC file");
  std::string text;
  for (std::array<char, 65536> piece; text.size() <= kMaxDbcBytes && file;) {
    file.read(piece.data(), piece.size());
    text.append(piece.data(), static_cast<std::size_t>(file.gcount()));
  }
  if (text.size() > kMaxDbcBytes)
    throw std::runtime_error(path + ": longer than 16 MiB, expected a DBC file");
  return parse_dbc_signal(text, path, message, signal);
}

DbcSignal parse_dbc_signal(const std::string& text, const std::string& path, const std::string& message,
                           const std::string& signal) {
  std::istringstream file(text);
  DbcSignal found;
  bool in_message = false, message_seen = false;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    const auto fail = [&](const std::string& why) {
      throw std::runtime_error(path + ":" + std::to_string(number) + ": " + why);
    };
    Scanner s(line);
    const std::string_view head = s.word();
    if (head == "BO_") {
      in_message = read_message(line, message, &found);
      message_seen = message_seen || in_message;
      continue;
    }
    if (!in_message || head != "SG_" || s.word() != signal) continue;
    if (found.id > kMaxStandardId) fail(message + " has an extended identifier, expected one of 11 bits");
    if (!read_layout(s, &found))
      fail("signal " + signal + ": expected 'SG_ " + signal +
           " : start|length@order sign (factor,offset) [min|max] \"unit\"'");
    if (!is_scaled_soundly(found))
      fail("signal " + signal +
           ": expected a factor other than 0, finite numbers, and a range whose end is not before its start");
    if (found.size == 0 || found.size > kMaxFrameBytes)
      fail("message " + message + " has " + std::to_string(found.size) + " bytes, expected 1 to " +
           std::to_string(kMaxFrameBytes));
    if (!fits(found))
      fail("signal " + signal + " lies outside its frame of " + std::to_string(found.size) + " bytes");
    return found;
  }
  throw std::runtime_error(
      path + ": " +
      (message_seen ? "message " + message + " has no signal " + signal : "no message " + message) +
      ", expected MESSAGE.SIGNAL of this file");
}

}  // namespace farpoint::ipc
