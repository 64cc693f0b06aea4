// SPDX-License-Identifier: Apache-2.0
// Axes of a diagram: range, ticks and their texts.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace farpoint::tools::report {

struct Axis {
  std::string label;  // with its unit
  bool is_log = false;
  std::optional<double> low = std::nullopt, high = std::nullopt;  // else from the data
};

// An axis with its range.
struct Scale {
  double low = 0.0, high = 1.0;
  bool is_log = false;
  // 0 at low, 1 at high.
  [[nodiscard]] double share(double value) const;
  // True for a finite value between the two ends.
  [[nodiscard]] bool holds(double value) const;
};

// Range of an axis around the given values; those that are not finite, or not positive on a logarithmic axis,
// do not count. from_zero: a linear axis of values that are not negative begins at zero if they come near it.
[[nodiscard]] Scale scale_around(const Axis& axis, const std::vector<double>& values, bool from_zero);

// Round values between two bounds, about `wanted` of them. A logarithmic axis that is too short for 1, 2, 5
// has those of a linear one.
[[nodiscard]] std::vector<double> ticks(double low, double high, int wanted, bool is_log);
// Text of a tick, with the digits that distinguish it from its neighbour `step` away.
[[nodiscard]] std::string tick_text(double value, double step, bool is_log);

}  // namespace farpoint::tools::report
