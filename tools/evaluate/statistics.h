// SPDX-License-Identifier: Apache-2.0
// Order statistics, as numpy defines them.
#pragma once

#include <vector>

namespace farpoint::tools {

// Percentile 0..100 with linear interpolation between the two nearest ranks; NaN for an empty set.
[[nodiscard]] double percentile(std::vector<double> values, double percent);
// NaN for an empty set.
[[nodiscard]] double mean(const std::vector<double>& values);
[[nodiscard]] double root_mean_square(const std::vector<double>& values);

}  // namespace farpoint::tools
