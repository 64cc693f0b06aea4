// SPDX-License-Identifier: Apache-2.0
// The point pairs of the binary descriptor.
#pragma once

#include <cstdint>
#include <span>

#include "slam/image/kernels.h"

namespace farpoint::slam {

// Pairs (x0, y0, x1, y1) in pixels of the corner's level, unrotated; all points lie within kPatchRadiusPx of
// the corner, so that they stay in the patch at every angle.
inline constexpr int kDescriptorPairs = 256;
extern const std::int8_t kDescriptorPattern[kDescriptorPairs][4];

// Angles that the pattern is turned to.
inline constexpr int kAngleBins = 128;
// The bin nearest to angle_rad, -pi..pi.
[[nodiscard]] int angle_bin(float angle_rad);
// Where pattern point (x, y) lies in the compact patch (kPatchStrideBytes) of a corner with an angle of that
// bin.
[[nodiscard]] std::uint16_t steered_offset(int x, int y, int bin);

// The pattern turned to each of the angles, as offsets into the compact patch.
class SteeredPattern {
 public:
  SteeredPattern();
  // 2 * kDescriptorPairs offsets.
  [[nodiscard]] const std::uint16_t* offsets(float angle_rad) const { return offsets_[angle_bin(angle_rad)]; }

 private:
  alignas(64) std::uint16_t offsets_[kAngleBins][2 * kDescriptorPairs];
};

}  // namespace farpoint::slam
