// SPDX-License-Identifier: Apache-2.0
// A diagram with two labelled axes. Lines differ in dash and thickness as well as in colour, so that they
// stay distinct in grey.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "tools/report/svg.h"

namespace farpoint::tools::report {

struct Style {
  std::string colour = "#000", dash;  // dash as SVG has it; empty: solid
  double width_px = 1.6;
};
// Of the n-th run; truth has its own.
[[nodiscard]] Style run_style(std::size_t n);
[[nodiscard]] Style truth_style();
[[nodiscard]] std::string stroke(const Style& style);

struct Axis {
  std::string label;  // with its unit
  bool is_log = false;
  std::optional<double> low = std::nullopt, high = std::nullopt;  // else from the data
};

struct PlotFrame {
  std::string title;
  Axis x, y;
  bool equal_units = false;  // one metre is as long along both axes
  double width_px = 520, height_px = 320;
};

class Plot {
 public:
  explicit Plot(PlotFrame frame) : frame_(std::move(frame)) {}

  void line(const std::string& name, std::vector<Eigen::Vector2d> points, const Style& style);
  void dots(const std::string& name, std::vector<Eigen::Vector2d> points, const std::string& colour,
            double side_px = 2.0);
  // Outline of a histogram: counts.size() + 1 edges.
  void steps(const std::string& name, const std::vector<double>& edges, const std::vector<double>& values,
             const Style& style);
  // A vertical line across the whole diagram.
  void mark_x(const std::string& name, double x, const Style& style);

  // Empty if nothing was drawn.
  [[nodiscard]] std::string svg() const;

 private:
  struct Layer {
    std::string name;
    std::vector<Eigen::Vector2d> points;
    Style style;
    bool is_line = true, is_mark = false;
    double side_px = 0.0;
  };
  struct Scale {
    double low = 0.0, high = 1.0;
    bool is_log = false;
    [[nodiscard]] double share(double value) const;
  };
  [[nodiscard]] Scale scale_of(const Axis& axis, int dimension) const;
  void draw_axes(const Scale& x, const Scale& y, Svg* svg) const;
  void draw_layers(const Scale& x, const Scale& y, Svg* svg) const;
  void draw_legend(Svg* svg) const;
  [[nodiscard]] Eigen::Vector2d place(const Scale& x, const Scale& y, const Eigen::Vector2d& p) const;
  [[nodiscard]] double legend_px() const;
  [[nodiscard]] Eigen::Vector2d corner_px() const;  // of the area between the axes
  [[nodiscard]] Eigen::Vector2d area_px() const;

  PlotFrame frame_;
  std::vector<Layer> layers_;
};

// Round values between two bounds, about `wanted` of them.
[[nodiscard]] std::vector<double> ticks(double low, double high, int wanted, bool is_log);

}  // namespace farpoint::tools::report
