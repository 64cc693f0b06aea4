// SPDX-License-Identifier: Apache-2.0
#include "slam/image/corner_selection.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace farpoint::slam {
namespace {

// Strongest first; equal ones in raster order, so that the choice is unique.
bool stronger(const Corner& a, const Corner& b) {
  if (a.score != b.score) return a.score > b.score;
  return a.y != b.y ? a.y < b.y : a.x < b.x;
}

// Moves the corners with coordinate < middle to the front and returns how many. Without a branch on the
// comparison, which is random and would be mispredicted every other time.
std::ptrdiff_t split_at(std::span<Corner> corners, int middle, std::uint16_t Corner::*coordinate) {
  std::size_t front = 0;
  for (Corner& corner : corners) {
    const std::size_t before = corner.*coordinate < middle ? 1U : 0U;
    std::swap(corner, corners[front]);
    front += before;
  }
  return static_cast<std::ptrdiff_t>(front);
}

}  // namespace

int select_spread(std::span<Corner> corners, PixelBox box, int quota) {
  const int count = static_cast<int>(corners.size());
  if (count <= quota) return count;
  if (quota <= 0) return 0;
  if (quota == 1) {
    std::iter_swap(corners.begin(), std::min_element(corners.begin(), corners.end(), stronger));
    return 1;
  }
  PixelBox low = box, high = box;
  const bool along_x = box.x1 - box.x0 >= box.y1 - box.y0;
  const int middle = along_x ? (box.x0 + box.x1) / 2 : (box.y0 + box.y1) / 2;
  (along_x ? low.x1 : low.y1) = middle;
  (along_x ? high.x0 : high.y0) = middle;
  const auto split = corners.begin() + split_at(corners, middle, along_x ? &Corner::x : &Corner::y);
  const std::span<Corner> low_corners(corners.begin(), split), high_corners(split, corners.end());
  const int low_count = static_cast<int>(low_corners.size()),
            high_count = static_cast<int>(high_corners.size());
  // The odd one goes where there is more to choose from.
  int low_quota = low_count >= high_count ? (quota + 1) / 2 : quota / 2;
  low_quota = std::clamp(low_quota, quota - high_count, low_count);
  const int low_chosen = select_spread(low_corners, low, low_quota);
  const int high_chosen = select_spread(high_corners, high, quota - low_quota);
  // The chosen of the upper half close up to those of the lower half: its last ones fill the gap.
  const int moved = std::min(high_chosen, low_count - low_chosen);
  std::swap_ranges(corners.begin() + low_chosen, corners.begin() + low_chosen + moved,
                   high_corners.begin() + (high_chosen - moved));
  return low_chosen + high_chosen;
}

void share_quota(int total, std::span<const double> weights, std::span<const int> available,
                 std::span<int> quota) {
  std::fill(quota.begin(), quota.end(), -1);  // -1: not decided yet
  double weight_left = 0;
  for (const double w : weights) weight_left += w;
  int left = total;
  // Levels that have less than their share give all they have; their rest raises the share of the others.
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t l = 0; l < quota.size(); ++l) {
      if (quota[l] >= 0 || available[l] > left * weights[l] / weight_left) continue;
      quota[l] = available[l];
      left -= available[l];
      weight_left -= weights[l];
      changed = true;
    }
  }
  // The rest is cut at rounded cumulative weights, so that the sum is exact.
  double cumulative = 0;
  int given = 0;
  for (std::size_t l = 0; l < quota.size(); ++l) {
    if (quota[l] >= 0) continue;
    cumulative += weights[l];
    const int target = static_cast<int>(std::lround(left * std::min(1.0, cumulative / weight_left)));
    quota[l] = std::min(target - given, available[l]);
    given = target;
  }
}

}  // namespace farpoint::slam
