// SPDX-License-Identifier: Apache-2.0
#include "ipc/message.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace farpoint::ipc {
namespace {

constexpr std::size_t kMaxCounts = 4;

// Walks bytes along a layout. Every read is checked against what is left.
class Walker {
 public:
  explicit Walker(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  [[nodiscard]] bool walk(std::string_view layout);
  [[nodiscard]] bool at_end() const { return bytes_.empty(); }

 private:
  bool take(std::size_t bytes) {
    if (bytes > bytes_.size()) return false;
    bytes_ = bytes_.subspan(bytes);
    return true;
  }
  // A length or count: never negative.
  bool take_length(std::size_t* length) {
    if (bytes_.size() < 4) return false;
    const std::uint32_t value = std::uint32_t{bytes_[0]} << 24 | std::uint32_t{bytes_[1]} << 16 |
                                std::uint32_t{bytes_[2]} << 8 | std::uint32_t{bytes_[3]};
    *length = value;
    return value <= INT32_MAX && take(4);
  }
  bool take_string();
  bool take_array(std::size_t count, std::string_view items);

  std::span<const std::uint8_t> bytes_;
};

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

std::size_t take_number(std::string_view* layout) {
  std::size_t value = 0;
  while (!layout->empty() && is_digit(layout->front())) {
    value = 10 * value + static_cast<std::size_t>(layout->front() - '0');
    layout->remove_prefix(1);
  }
  return value;
}

// Length of the bracket's content, without the closing bracket; `layout` starts just behind the opening one.
std::size_t bracket_length(std::string_view layout) {
  int depth = 1;
  for (std::size_t i = 0; i < layout.size(); ++i) {
    if (layout[i] == '[') ++depth;
    if (layout[i] == ']' && --depth == 0) return i;
  }
  return layout.size();
}

bool Walker::take_string() {
  std::size_t length = 0;
  if (!take_length(&length) || length == 0 || length > bytes_.size()) return false;  // the NUL is counted
  // A NUL within would make a shorter string of it, which no longer encodes to its length.
  const std::span<const std::uint8_t> string = bytes_.first(length);
  if (std::find(string.begin(), string.end(), 0) != string.end() - 1) return false;
  return take(length);
}

bool Walker::take_array(std::size_t count, std::string_view items) {
  std::string_view rest = items;
  const std::size_t element_bytes = take_number(&rest);
  if (rest.empty() && element_bytes > 0) {  // numbers only: no loop
    return count <= bytes_.size() / element_bytes && take(count * element_bytes);
  }
  if (count > bytes_.size()) return false;  // every element has a byte at least
  for (std::size_t i = 0; i < count; ++i) {
    if (!walk(items)) return false;
  }
  return true;
}

bool Walker::walk(std::string_view layout) {
  std::array<std::size_t, kMaxCounts> counts{};
  std::size_t known = 0;
  while (!layout.empty()) {
    const char item = layout.front();
    if (is_digit(item)) {
      if (!take(take_number(&layout))) return false;
      continue;
    }
    layout.remove_prefix(1);
    if (item == 's' && !take_string()) return false;
    if (item == '#' && !(known < kMaxCounts && take_length(&counts[known++]))) return false;
    if (item == '[') {
      const std::size_t length = bracket_length(layout);
      std::string_view content = layout.substr(0, length);
      layout.remove_prefix(length + 1);
      const std::size_t which = take_number(&content);
      content.remove_prefix(1);  // ':'
      if (which >= known || !take_array(counts[which], content)) return false;
    }
  }
  return true;
}

}  // namespace

bool fits_layout(std::span<const std::uint8_t> bytes, std::string_view layout) {
  Walker walker(bytes);
  return walker.walk(layout) && walker.at_end();
}

}  // namespace farpoint::ipc
