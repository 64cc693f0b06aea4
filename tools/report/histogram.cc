// SPDX-License-Identifier: Apache-2.0
#include "tools/report/histogram.h"

#include <algorithm>
#include <cmath>

namespace farpoint::tools::report {

std::vector<double> edges(double low, double high, int n, bool is_log) {
  std::vector<double> out;
  for (int i = 0; i <= n; ++i) {
    const double share = static_cast<double>(i) / n;
    out.push_back(is_log ? low * std::pow(high / low, share) : low + share * (high - low));
  }
  return out;
}

std::vector<double> keyframe_edges(double high_s, double frame_s, int frames_a_keyframe, int most) {
  const double keyframe_s = frame_s * frames_a_keyframe;
  const double keyframes_a_bin =
      std::max(1.0, std::ceil((high_s + 0.5 * frame_s) / (most * keyframe_s) - 1e-9));
  const double width_s = keyframes_a_bin * keyframe_s;
  std::vector<double> out = {-0.5 * frame_s};
  for (int i = 1; i <= most && out.back() < high_s; ++i) out.push_back(i * width_s - 0.5 * frame_s);
  return out;
}

std::vector<double> shares_percent(const std::vector<double>& values, const std::vector<double>& edges) {
  std::vector<double> shares(edges.size() - 1, 0.0);
  for (const double v : values) {
    const auto above = std::upper_bound(edges.begin(), edges.end(), v);
    if (above == edges.begin() || above == edges.end()) continue;
    shares[static_cast<std::size_t>(above - edges.begin()) - 1] += 100.0 / static_cast<double>(values.size());
  }
  return shares;
}

}  // namespace farpoint::tools::report
