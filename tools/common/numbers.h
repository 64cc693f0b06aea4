// SPDX-License-Identifier: Apache-2.0
// Whole numbers and times as data sets write them.
#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string_view>
#include <system_error>

namespace farpoint::tools {

// The whole text as a decimal integer; empty for anything else.
[[nodiscard]] inline std::optional<std::int64_t> whole_number(std::string_view text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  return value;
}

// Latest time of a recording, microseconds. Later ones do not fit the 53 bits of a double.
inline constexpr std::int64_t kMaxUtime = 9'000'000'000'000'000;

// Rounded to nearest. Precondition: `nanoseconds` is not negative.
[[nodiscard]] constexpr std::int64_t microseconds_of(std::int64_t nanoseconds) {
  return nanoseconds / 1000 + (nanoseconds % 1000 >= 500 ? 1 : 0);
}

}  // namespace farpoint::tools
