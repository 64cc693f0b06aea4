// SPDX-License-Identifier: Apache-2.0
// Rays of each pixel of a camera, and the cells of the perspective views that the scene is drawn into. Lens
// distortion is thereby exact in the textures, and good to a fraction of a pixel in the outlines.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "slam/geometry/camera.h"

namespace farpoint::tools::simulate {

// One perspective view: faces are drawn into it; cells have their centres at whole numbers.
struct RasterView {
  Eigen::Matrix3f R_view_camera = Eigen::Matrix3f::Identity();
  int width = 0, height = 0;
  float focal_x = 1, focal_y = 1, centre_x = 0, centre_y = 0;
  std::uint32_t first_cell = 0;  // within the memory that all views share
};

// For one place within the pixels ("jitter"): all rays start there.
struct RayTable {
  static constexpr std::int32_t kNoCell = -1;  // the lens model has no ray for this pixel
  std::vector<RasterView> views;
  std::vector<float> x, y, z;      // unit rays in camera axes, row by row; 16 more than there are pixels
  std::vector<std::int32_t> cell;  // of each pixel
  std::uint32_t cells = 0;         // of all views
  // Rows of each view that a band of image rows looks into: bands * views pairs [first, last).
  struct Rows {
    int first = 0, last = 0;
  };
  [[nodiscard]] std::vector<Rows> rows_of_band(int first_row, int last_row, int image_width) const;
};

[[nodiscard]] RayTable make_ray_table(const slam::Camera& camera, const Eigen::Vector2d& jitter_px);

}  // namespace farpoint::tools::simulate
