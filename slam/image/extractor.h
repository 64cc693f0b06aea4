// SPDX-License-Identifier: Apache-2.0
// FAST corners spread over the image, oriented, with binary descriptors.
#pragma once

#include <limits>
#include <memory>

#include "slam/image/feature.h"
#include "slam/image/pyramid.h"

namespace farpoint::slam {

struct ExtractorOptions {
  int features = 1500;         // wanted over all levels; never exceeded
  int fast_threshold = 20;     // grey levels; first try in every cell
  int fast_threshold_min = 7;  // grey levels; second try in a cell that found nothing
  int cell_px = 32;            // side of a cell of the corner grid, level pixels
};

// Working memory is allocated in the constructor; extract() allocates nothing (after the set has its
// capacity).
class Extractor {
 public:
  static constexpr int kAllFeatures = std::numeric_limits<int>::max();

  Extractor(int width_px, int height_px, const PyramidOptions& pyramid, const ExtractorOptions& options);
  ~Extractor();
  Extractor(const Extractor&) = delete;
  Extractor& operator=(const Extractor&) = delete;

  // Corners of all levels into *out, ordered by level, then row-major by cell. `mask` (of level 0's size;
  // null: none): no corner whose descriptor depends on a masked pixel. Features are spread over the image: no
  // region may take the quota of another. At most `most` features, where that is less than the options say.
  void extract(const Pyramid& pyramid, const ImageMask* mask, FeatureSet* out, int most = kAllFeatures);

 private:
  struct Workspace;
  std::unique_ptr<Workspace> workspace_;
};

}  // namespace farpoint::slam
