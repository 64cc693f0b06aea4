// SPDX-License-Identifier: Apache-2.0
// A frame: what the cameras of the rig show at one time.
#pragma once

#include <cstdint>
#include <memory>

#include "slam/image/feature_grid.h"
#include "slam/map/per_camera.h"

namespace farpoint::slam {

// Of one camera. Without features where that camera gave no image.
struct FrameView {
  FeatureSet set;
  FeatureGrid grid;
  std::shared_ptr<const FrameImage> image;  // null: pixels not kept, or no image
};

struct Frame {
  std::uint64_t number = 0;  // counts processed frames, from 0
  std::int64_t utime = 0;
  std::int64_t sequence = 0;
  bool repeats = false;  // each image is the one before, bit for bit: it has no features
  PerCamera<FrameView> views;

  // Some camera's pixels are there.
  [[nodiscard]] bool has_pixels() const {
    for (int c = 0; c < views.size(); ++c)
      if (views[c].image != nullptr) return true;
    return false;
  }
  void drop_pixels() {
    for (int c = 0; c < views.size(); ++c) views[c].image.reset();
  }
  // Of all cameras.
  [[nodiscard]] std::size_t feature_count() const {
    std::size_t count = 0;
    for (int c = 0; c < views.size(); ++c) count += views[c].set.features.size();
    return count;
  }
};

}  // namespace farpoint::slam
