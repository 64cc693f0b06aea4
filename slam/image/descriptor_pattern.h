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

// The pattern turned to each of kAngleBins angles, as offsets into the compact patch (kPatchStrideBytes).
class SteeredPattern {
 public:
  static constexpr int kAngleBins = 128;
  SteeredPattern();
  // 2 * kDescriptorPairs offsets for the bin nearest to angle_rad (-pi..pi).
  [[nodiscard]] const std::uint16_t* offsets(float angle_rad) const;

 private:
  alignas(64) std::uint16_t offsets_[kAngleBins][2 * kDescriptorPairs];
};

}  // namespace farpoint::slam
