// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/render/occlusion.h"

#include <algorithm>
#include <cmath>

namespace farpoint::tools::simulate {
namespace {

struct Range {
  int first = 0, last = 0;  // last not included
};

// Cells along one axis that a box of half size r about (x, z) projects to.
Range cells_of(float x, float z, float r, float focal, float centre, int low, int high) {
  const float left = x - r, right = x + r;
  const float a = focal * left / (left < 0.0F ? z - r : z + r) + centre;
  const float b = focal * right / (right > 0.0F ? z - r : z + r) + centre;
  const auto bound = [&](float v) {
    return std::clamp(v, static_cast<float>(low), static_cast<float>(high));
  };
  return {static_cast<int>(std::floor(bound(a))), static_cast<int>(std::ceil(bound(b + 1.0F)))};
}

// Written without a branch, so that it is done for many cells at once.
bool any_beyond(const float* inverse_depth, int count, float limit) {
  int beyond = 0;
  for (int i = 0; i < count; ++i) beyond |= inverse_depth[i] < limit ? 1 : 0;
  return beyond != 0;
}

}  // namespace

bool is_hidden(const Eigen::Vector3f& centre_in_view, float radius_m, const RasterView& view, int first_row,
               int last_row, const float* inverse_depth) {
  constexpr float kSmallest_m = 0.5F;
  const float nearest_m = centre_in_view.z() - radius_m;
  if (nearest_m < kSmallest_m) return false;
  const Range columns =
      cells_of(centre_in_view.x(), centre_in_view.z(), radius_m, view.focal_x, view.centre_x, 0, view.width);
  const Range rows = cells_of(centre_in_view.y(), centre_in_view.z(), radius_m, view.focal_y, view.centre_y,
                              first_row, last_row);
  if (columns.first >= columns.last || rows.first >= rows.last) return true;
  const float limit = 1.0F / nearest_m;
  const int count = columns.last - columns.first;
  // The middle first: what can be seen is mostly seen there.
  const int middle = (rows.first + rows.last) / 2;
  const auto row_is_open = [&](int row) {
    const std::size_t cell = view.first_cell +
                             static_cast<std::size_t>(row) * static_cast<std::size_t>(view.width) +
                             static_cast<std::size_t>(columns.first);
    return any_beyond(inverse_depth + cell, count, limit);
  };
  if (row_is_open(middle)) return false;
  for (int row = rows.first; row < rows.last; ++row) {
    if (row_is_open(row)) return false;
  }
  return true;
}

}  // namespace farpoint::tools::simulate
