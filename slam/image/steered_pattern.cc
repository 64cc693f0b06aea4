#include <cmath>
#include <numbers>

#include "slam/image/descriptor_pattern.h"

namespace farpoint::slam {
namespace {

std::uint16_t rotated_offset(int x, int y, double cosine, double sine) {
  const int rx = static_cast<int>(std::lround(cosine * x - sine * y));
  const int ry = static_cast<int>(std::lround(sine * x + cosine * y));
  return static_cast<std::uint16_t>((ry + kPatchRadiusPx) * kPatchStrideBytes + rx + kPatchRadiusPx);
}

}  // namespace

SteeredPattern::SteeredPattern() {
  for (int bin = 0; bin < kAngleBins; ++bin) {
    const double angle = 2 * std::numbers::pi * bin / kAngleBins;
    const double c = std::cos(angle), s = std::sin(angle);
    for (int i = 0; i < kDescriptorPairs; ++i) {
      const std::int8_t* p = kDescriptorPattern[i];
      offsets_[bin][2 * i] = rotated_offset(p[0], p[1], c, s);
      offsets_[bin][2 * i + 1] = rotated_offset(p[2], p[3], c, s);
    }
  }
}

const std::uint16_t* SteeredPattern::offsets(float angle_rad) const {
  constexpr float kBinsPerRad = kAngleBins / (2 * std::numbers::pi_v<float>);
  static_assert((kAngleBins & (kAngleBins - 1)) == 0, "the mask below wraps negative bins");
  const int bin = static_cast<int>(std::lround(angle_rad * kBinsPerRad)) & (kAngleBins - 1);
  return offsets_[bin];
}

}  // namespace farpoint::slam
