// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/world/canvas.h"

#include <algorithm>
#include <cmath>

namespace farpoint::tools::simulate {

Canvas::Canvas(int width, int height, double width_m, double height_m, float value)
    : width_(width),
      height_(height),
      width_m_(width_m),
      height_m_(height_m),
      values_(static_cast<std::size_t>(width * height), value) {}

float& Canvas::at(int x, int y) {
  return values_[static_cast<std::size_t>((y & (height_ - 1)) * width_ + (x & (width_ - 1)))];
}

void Canvas::rectangle(double x0_m, double y0_m, double x1_m, double y1_m, float value) {
  const int x0 = static_cast<int>(std::lround(x0_m / width_m_ * width_));
  const int x1 = static_cast<int>(std::lround(x1_m / width_m_ * width_));
  const int y0 = static_cast<int>(std::lround(y0_m / height_m_ * height_));
  const int y1 = static_cast<int>(std::lround(y1_m / height_m_ * height_));
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) at(x, y) = value;
  }
}

void Canvas::ellipse(double x_m, double y_m, double radius_x_m, double radius_y_m, double angle_rad,
                     float value) {
  const double reach = std::max(radius_x_m, radius_y_m), c = std::cos(angle_rad), s = std::sin(angle_rad);
  const int x0 = static_cast<int>(std::floor((x_m - reach) / width_m_ * width_));
  const int x1 = static_cast<int>(std::ceil((x_m + reach) / width_m_ * width_));
  const int y0 = static_cast<int>(std::floor((y_m - reach) / height_m_ * height_));
  const int y1 = static_cast<int>(std::ceil((y_m + reach) / height_m_ * height_));
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const double dx = (x + 0.5) * width_m_ / width_ - x_m, dy = (y + 0.5) * height_m_ / height_ - y_m;
      const double a = (c * dx + s * dy) / radius_x_m, b = (c * dy - s * dx) / radius_y_m;
      if (a * a + b * b < 1.0) at(x, y) = value;
    }
  }
}

void Canvas::each(const std::function<float(double, double, float)>& change) {
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      float& value = at(x, y);
      value = change((x + 0.5) * width_m_ / width_, (y + 0.5) * height_m_ / height_, value);
    }
  }
}

}  // namespace farpoint::tools::simulate
