// SPDX-License-Identifier: Apache-2.0
// Counts of values between edges.
#pragma once

#include <vector>

namespace farpoint::tools::report {

// From low to high, n steps; in equal ratios where is_log.
[[nodiscard]] std::vector<double> edges(double low, double high, int n, bool is_log = false);
// Share of the values between each pair of edges, in percent of all of them; what lies outside counts too.
[[nodiscard]] std::vector<double> shares_percent(const std::vector<double>& values,
                                                 const std::vector<double>& edges);

}  // namespace farpoint::tools::report
