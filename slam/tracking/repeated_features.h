// SPDX-License-Identifier: Apache-2.0
// Features that repeat those of the frame before, bit for bit, place and descriptor: noise makes every
// exposure another. A part of the image that does not change is frozen by the camera or by what carries its
// images.
#pragma once

#include <cstdint>
#include <vector>

#include "slam/image/feature.h"

namespace farpoint::slam {

class RepeatedFeatures {
 public:
  // Room for `features` of a frame.
  explicit RepeatedFeatures(std::size_t features);

  // The next frame. Returns the share of its features that the frame before had; 0 for the first frame.
  double add(const FeatureSet& set);

  [[nodiscard]] std::size_t bytes() const;

 private:
  // Open addressing, 0 is free; sizes are powers of two.
  std::vector<std::uint64_t> before_, now_;
};

}  // namespace farpoint::slam
