// SPDX-License-Identifier: Apache-2.0
#include "slam/image/feature_grid.h"

#include <algorithm>
#include <cmath>

namespace farpoint::slam {

FeatureGrid::FeatureGrid(int width_px, int height_px, int cell_px, std::size_t max_features)
    : columns_((width_px + cell_px - 1) / cell_px),
      rows_((height_px + cell_px - 1) / cell_px),
      inverse_cell_(1.0F / static_cast<float>(cell_px)) {
  starts_.assign(static_cast<std::size_t>(columns_ * rows_) + 1, 0);
  indices_.reserve(max_features);
}

int FeatureGrid::clamp_column(float u_px) const {
  return static_cast<int>(
      std::clamp(std::floor(u_px * inverse_cell_), 0.0F, static_cast<float>(columns_ - 1)));
}

int FeatureGrid::clamp_row(float v_px) const {
  return static_cast<int>(std::clamp(std::floor(v_px * inverse_cell_), 0.0F, static_cast<float>(rows_ - 1)));
}

void FeatureGrid::build(const std::vector<Feature>& features) {
  const auto cell_of = [this](const Feature& f) {
    return static_cast<std::size_t>(clamp_row(f.v_px) * columns_ + clamp_column(f.u_px));
  };
  std::fill(starts_.begin(), starts_.end(), 0U);
  for (const Feature& f : features) ++starts_[cell_of(f) + 1];
  for (std::size_t c = 1; c < starts_.size(); ++c) starts_[c] += starts_[c - 1];
  indices_.resize(features.size());
  // Filling from the back moves every start to its final place and keeps the order within a cell.
  std::vector<std::uint32_t>& end = starts_;
  for (std::size_t i = features.size(); i-- > 0;) {
    const std::size_t c = cell_of(features[i]) + 1;
    indices_[--end[c]] = static_cast<std::uint32_t>(i);
  }
  // After the loop starts_[c + 1] holds the first entry of cell c: shift back by one.
  for (std::size_t c = 0; c + 1 < starts_.size(); ++c) starts_[c] = starts_[c + 1];
  starts_.back() = static_cast<std::uint32_t>(features.size());
}

}  // namespace farpoint::slam
