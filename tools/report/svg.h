// SPDX-License-Identifier: Apache-2.0
// SVG as text: shapes in pixels, y down, attributes by style classes of the page (html.cc).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace farpoint::tools::report {

// &, <, >, " as entities.
[[nodiscard]] std::string escaped(std::string_view text);
// Short decimal: at most `digits` after the point, no zeros at the end.
[[nodiscard]] std::string number(double value, int digits = 2);

enum class Anchor { kStart, kMiddle, kEnd };

class Svg {
 public:
  Svg(double width_px, double height_px) : width_px_(width_px), height_px_(height_px) {}

  // `attributes` goes into the element as it is, like `class="axis"`.
  void line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, std::string_view attributes);
  // `digits`: of the pixels; what the page's script zooms into or reads values from needs more of them.
  void polyline(const std::vector<Eigen::Vector2d>& points, std::string_view attributes, int digits = 1);
  void rectangle(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, std::string_view attributes);
  void circle(const Eigen::Vector2d& centre, double radius_px, std::string_view attributes);
  void text(const Eigen::Vector2d& at, std::string_view text, Anchor anchor,
            std::string_view attributes = "");
  void turned_text(const Eigen::Vector2d& at, std::string_view text);  // reads upwards, centred
  // Many small squares as one path element; they keep their size where the page's script zooms.
  void dots(const std::vector<Eigen::Vector2d>& points, double side_px, std::string_view colour);
  void jpeg(const std::vector<std::uint8_t>& bytes, double width_px, double height_px);
  void begin_group(std::string_view attributes);
  void end_group();
  // Clips what is added between the two calls at the rectangle.
  void begin_clip(const Eigen::Vector2d& corner, const Eigen::Vector2d& size);
  void end_clip();

  // The whole element; `title` is the text for screen readers, `attributes` begins with a blank or is empty.
  [[nodiscard]] std::string finish(std::string_view title, std::string_view attributes = {}) const;

 private:
  double width_px_, height_px_;
  std::string body_;
};

}  // namespace farpoint::tools::report
