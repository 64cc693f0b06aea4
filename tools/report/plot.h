// SPDX-License-Identifier: Apache-2.0
// A diagram with two labelled axes. Lines differ in dash and thickness as well as in colour, so that they
// stay distinct in grey. The page's script reads the data- attributes of the drawing (script.h).
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "tools/report/axis.h"
#include "tools/report/svg.h"

namespace farpoint::tools::report {

struct Style {
  std::string colour = "#000", dash;  // dash as SVG has it; empty: solid
  double width_px = 1.6;
};
// Of the n-th run; truth has its own.
[[nodiscard]] Style run_style(std::size_t n);
// The run's second line: the same colour and dash, thinner.
[[nodiscard]] Style thin_run_style(std::size_t n);
[[nodiscard]] Style truth_style();
[[nodiscard]] std::string stroke(const Style& style);

struct PlotFrame {
  std::string title;
  Axis x, y;
  bool equal_units = false;  // one metre is as long along both axes
  double width_px = 520, height_px = 320;
};

// Values of a coloured path, and the range that its colours span.
struct ColouredValues {
  std::vector<double> values;  // one a point
  double low = 0.0, high = 1.0;
  std::string label;  // with its unit
};

class Plot {
 public:
  explicit Plot(PlotFrame frame) : frame_(std::move(frame)) {}

  // A point that is not finite breaks the line.
  void line(const std::string& name, const std::vector<Eigen::Vector2d>& points, const Style& style);
  void dots(const std::string& name, std::vector<Eigen::Vector2d> points, const std::string& colour,
            double side_px = 2.0);
  // Outline of a histogram: counts.size() + 1 edges.
  void steps(const std::string& name, const std::vector<double>& edges, const std::vector<double>& values,
             const Style& style);
  // A vertical line across the whole diagram.
  void mark_x(const std::string& name, double x, const Style& style);
  // A horizontal one.
  void mark_y(const std::string& name, double y, const Style& style);
  // A line whose colour shows a value; a bar below the diagram explains the colours. One a diagram.
  void coloured_line(std::vector<Eigen::Vector2d> points, ColouredValues values);
  // A ring with a word beside it, like "start".
  void label_point(const std::string& word, const Eigen::Vector2d& at);

  // Empty if no line or dot lies between the axes.
  [[nodiscard]] std::string svg() const;

 private:
  enum class Kind { kLine, kDots, kMarkX, kMarkY, kColoured, kLabel };
  struct Layer {
    Kind kind = Kind::kLine;
    std::string name;
    std::vector<Eigen::Vector2d> points;
    Style style;
    double side_px = 0.0;
    ColouredValues colours;
  };
  struct Scales {
    Scale x, y;
  };
  [[nodiscard]] Scales scales() const;
  [[nodiscard]] bool shows_something(const Scales& scales) const;
  void draw_axes(const Scales& scales, Svg* svg) const;
  void draw_layers(const Scales& scales, Svg* svg) const;
  void draw_layer(const Layer& layer, const Scales& scales, Svg* svg) const;
  void draw_line(const Layer& layer, const Scales& scales, Svg* svg) const;
  void draw_coloured(const Layer& layer, const Scales& scales, Svg* svg) const;
  void draw_legend(Svg* svg) const;
  void draw_colour_bar(const Layer& layer, double top_px, Svg* svg) const;
  [[nodiscard]] Eigen::Vector2d place(const Scales& scales, const Eigen::Vector2d& p) const;
  [[nodiscard]] std::vector<const Layer*> named_layers() const;
  [[nodiscard]] const Layer* coloured_layer() const;
  [[nodiscard]] double width_px() const;  // between the axes
  [[nodiscard]] int legend_columns() const;
  [[nodiscard]] double legend_px() const;
  [[nodiscard]] Eigen::Vector2d corner_px() const;  // of the area between the axes
  [[nodiscard]] Eigen::Vector2d area_px() const;

  PlotFrame frame_;
  std::vector<Layer> layers_;
};

// At most about `most` of a line's points: of each stretch the first, the lowest and the highest, and a
// break.
[[nodiscard]] std::vector<Eigen::Vector2d> thinned(const std::vector<Eigen::Vector2d>& points,
                                                   std::size_t most);

}  // namespace farpoint::tools::report
