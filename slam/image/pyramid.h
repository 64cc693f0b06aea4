// SPDX-License-Identifier: Apache-2.0
// Scale pyramid of a grey image, in memory allocated once.
#pragma once

#include <memory>

#include "slam/geometry/image_mask.h"
#include "slam/image/feature.h"

namespace farpoint::slam {

struct PyramidOptions {
  int levels = 8;
  double scale_factor = 1.2;  // size ratio of neighbouring levels
};

// All levels of one image. Level l has size round(size / scale^l). Level 0 is a copy of the input (the input
// belongs to a driver). Allocation happens in the constructor only.
class Pyramid {
 public:
  Pyramid(int width_px, int height_px, const PyramidOptions& options);
  // Fills every level. The image must have the constructor's size (asserted; callers check before).
  void build(const ImageView& image);

  [[nodiscard]] int levels() const;
  [[nodiscard]] ImageView level(int l) const;
  [[nodiscard]] float scale(int l) const;  // level-0 pixels a pixel of level l
  // Half side, level-0 pixels, of the square that determines the square of half side `radius_px` (pixels of
  // level l) around a pixel of level l: levels are blurred, so it is more than the radius times the scale.
  [[nodiscard]] double support_px(int l, double radius_px) const;
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Storage;
  std::shared_ptr<Storage> storage_;
};

// FrameImage on a pyramid; the pyramid must outlive it.
class PyramidImage final : public FrameImage {
 public:
  PyramidImage() = default;
  // No patch and no measurement depends on a masked pixel. The mask must outlive the image; null: none.
  explicit PyramidImage(const Pyramid* pyramid, const ImageMask* mask = nullptr)
      : pyramid_(pyramid), mask_(mask) {}
  [[nodiscard]] bool extract_patch(const FeatureSet& set, std::size_t index, Patch* patch) const override;
  [[nodiscard]] Alignment align(const Patch& host, const Eigen::Matrix2f& A_target_host,
                                const Eigen::Vector2f& predicted_px, float max_shift_px) const override;
  [[nodiscard]] bool correlate(const Patch& host, const Eigen::Matrix2f& A_target_host,
                               std::span<const Eigen::Vector2f> pixels, std::span<float> zncc) const override;

 private:
  const Pyramid* pyramid_ = nullptr;
  const ImageMask* mask_ = nullptr;
};

}  // namespace farpoint::slam
