// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include "slam/image/descriptor_pattern.h"

namespace farpoint::slam {

int angle_bin(float angle_rad) {
  constexpr float kBinsPerRad = kAngleBins / (2 * std::numbers::pi_v<float>);
  static_assert((kAngleBins & (kAngleBins - 1)) == 0, "the mask below wraps negative bins");
  return static_cast<int>(std::lround(angle_rad * kBinsPerRad)) & (kAngleBins - 1);
}

std::uint16_t steered_offset(int x, int y, int bin) {
  const double angle = 2 * std::numbers::pi * bin / kAngleBins, c = std::cos(angle), s = std::sin(angle);
  const int rx = static_cast<int>(std::lround(c * x - s * y));
  const int ry = static_cast<int>(std::lround(s * x + c * y));
  return static_cast<std::uint16_t>((ry + kPatchRadiusPx) * kPatchStrideBytes + rx + kPatchRadiusPx);
}

SteeredPattern::SteeredPattern() {
  for (int bin = 0; bin < kAngleBins; ++bin) {
    for (int i = 0; i < kDescriptorPairs; ++i) {
      const std::int8_t* p = kDescriptorPattern[i];
      offsets_[bin][2 * i] = steered_offset(p[0], p[1], bin);
      offsets_[bin][2 * i + 1] = steered_offset(p[2], p[3], bin);
    }
  }
}

}  // namespace farpoint::slam
