// SPDX-License-Identifier: Apache-2.0
// Choice of corners that are strong and spread evenly over the image.
#pragma once

#include <cstdint>
#include <span>

namespace farpoint::slam {

// A corner on its pyramid level. One machine word, so that moving it is one load and one store.
struct alignas(8) Corner {
  std::uint16_t x = 0, y = 0;  // level pixels
  std::uint16_t score = 0;     // FAST score
  std::uint16_t unused = 0;
};
static_assert(sizeof(Corner) == 8);

// Half-open box of level pixels.
struct PixelBox {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

// Moves the chosen corners, at most `quota`, to the front of `corners` and returns how many they are. The box
// is halved again and again and each half gets half of the quota (what it cannot use goes to the other), down
// to boxes with a quota of one, which keep their strongest corner: every region gets the same share, however
// strong its neighbours are. All corners must lie in the box, no two on the same pixel. The result depends
// only on the input's order.
int select_spread(std::span<Corner> corners, PixelBox box, int quota);

// Shares `total` among levels by weight, none above its `available`; what a level cannot use goes to the
// others. All spans have the same length.
void share_quota(int total, std::span<const double> weights, std::span<const int> available,
                 std::span<int> quota);

}  // namespace farpoint::slam
