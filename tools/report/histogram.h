// SPDX-License-Identifier: Apache-2.0
// Counts of values between edges.
#pragma once

#include <vector>

namespace farpoint::tools::report {

// From low to high, n steps; in equal ratios where is_log.
[[nodiscard]] std::vector<double> edges(double low, double high, int n, bool is_log = false);
// Edges for times that are whole numbers of frames apart, as keyframes are: every bin holds as many frames as
// the others, and none of its edges is such a time. From -half a frame to at least high_s, at most `most`
// bins of whole keyframe intervals. Preconditions: frame_s and frames_a_keyframe are positive.
[[nodiscard]] std::vector<double> keyframe_edges(double high_s, double frame_s, int frames_a_keyframe,
                                                 int most);
// Share of the values between each pair of edges, in percent of all of them; what lies outside counts too.
[[nodiscard]] std::vector<double> shares_percent(const std::vector<double>& values,
                                                 const std::vector<double>& edges);

}  // namespace farpoint::tools::report
