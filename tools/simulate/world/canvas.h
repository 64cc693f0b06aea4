// SPDX-License-Identifier: Apache-2.0
// A drawing surface for textures, in metres: everything wraps around at its edges.
#pragma once

#include <functional>
#include <vector>

#include "tools/simulate/world/texture.h"

namespace farpoint::tools::simulate {

class Canvas {
 public:
  // width and height in texels are powers of two; they stand for width_m by height_m. Row 0 is the bottom.
  Canvas(int width, int height, double width_m, double height_m, float value);

  // Axis-parallel rectangle with sharp edges.
  void rectangle(double x0_m, double y0_m, double x1_m, double y1_m, float value);
  void ellipse(double x_m, double y_m, double radius_x_m, double radius_y_m, double angle_rad, float value);
  // Each texel becomes change(x_m, y_m, value).
  void each(const std::function<float(double x_m, double y_m, float value)>& change);

  [[nodiscard]] Texture texture() const { return {width_, height_, values_}; }
  [[nodiscard]] double width_m() const { return width_m_; }
  [[nodiscard]] double height_m() const { return height_m_; }

 private:
  float& at(int x, int y);

  int width_, height_;
  double width_m_, height_m_;
  std::vector<float> values_;
};

}  // namespace farpoint::tools::simulate
