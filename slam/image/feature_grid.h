// SPDX-License-Identifier: Apache-2.0
// Finds the features near a pixel. Built once a frame, no allocation after the constructor.
#pragma once

#include <cstdint>
#include <vector>

#include "slam/image/feature.h"

namespace farpoint::slam {

class FeatureGrid {
 public:
  FeatureGrid(int width_px, int height_px, int cell_px, std::size_t max_features);
  FeatureGrid() = default;

  [[nodiscard]] std::size_t bytes() const {
    return (starts_.capacity() + indices_.capacity()) * sizeof(std::uint32_t);
  }

  // Sorts the features into cells (counting sort, stable: ascending index within a cell).
  void build(const std::vector<Feature>& features);

  // Calls visit(index) for every feature within radius_px (square window) of (u, v) and with min_level <=
  // level <= max_level, in a fixed order.
  template <typename Visitor>
  void visit_near(const std::vector<Feature>& features, float u_px, float v_px, float radius_px,
                  int min_level, int max_level, Visitor&& visit) const {
    if (starts_.empty()) return;
    const int x0 = clamp_column(u_px - radius_px), x1 = clamp_column(u_px + radius_px);
    const int y0 = clamp_row(v_px - radius_px), y1 = clamp_row(v_px + radius_px);
    for (int y = y0; y <= y1; ++y) {
      const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_);
      const std::size_t first = row + static_cast<std::size_t>(x0), last = row + static_cast<std::size_t>(x1);
      for (std::uint32_t k = starts_[first]; k < starts_[last + 1]; ++k) {
        const std::uint32_t index = indices_[k];
        const Feature& f = features[index];
        if (f.level < min_level || f.level > max_level) continue;
        if (f.u_px < u_px - radius_px || f.u_px > u_px + radius_px) continue;
        if (f.v_px < v_px - radius_px || f.v_px > v_px + radius_px) continue;
        visit(static_cast<std::size_t>(index));
      }
    }
  }

 private:
  [[nodiscard]] int clamp_column(float u_px) const;
  [[nodiscard]] int clamp_row(float v_px) const;

  int columns_ = 0, rows_ = 0;
  float inverse_cell_ = 0;
  std::vector<std::uint32_t> starts_;  // first entry of each cell in indices_, columns*rows + 1 values
  std::vector<std::uint32_t> indices_;
};

}  // namespace farpoint::slam
