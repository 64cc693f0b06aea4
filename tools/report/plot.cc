// SPDX-License-Identifier: Apache-2.0
#include "tools/report/plot.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace farpoint::tools::report {
namespace {

constexpr double kLeft_px = 62, kRight_px = 14, kTop_px = 30, kBottom_px = 44, kLegendRow_px = 17;
// More points than this a line cannot show.
constexpr std::size_t kMostPoints = 1500;

std::vector<Eigen::Vector2d> thinned(std::vector<Eigen::Vector2d> points) {
  if (points.size() <= kMostPoints) return points;
  const std::size_t step = (points.size() + kMostPoints - 1) / kMostPoints;
  std::vector<Eigen::Vector2d> kept;
  for (std::size_t i = 0; i < points.size(); i += step) kept.push_back(points[i]);
  kept.push_back(points.back());
  return kept;
}

// Digits after the point that tell neighbouring ticks apart.
std::string tick_text(double value, double step, bool is_log) {
  if (is_log) return number(value, value < 1.0 ? 3 : 0);
  const int digits = step >= 1.0 ? 0 : static_cast<int>(std::ceil(-std::log10(step) - 1e-9));
  return number(value, std::min(digits, 6));
}

}  // namespace

Style run_style(std::size_t n) {
  // Of falling lightness: they stay apart in grey too.
  static const std::array<Style, 5> kStyles = {
      Style{"#0b3c78", "", 2.2}, Style{"#d8702a", "7 3", 2.2}, Style{"#3d9970", "2 2.5", 2.4},
      Style{"#8e44ad", "9 3 2 3", 2.0}, Style{"#b0a000", "4 2 1 2", 2.0}};
  return kStyles[n % kStyles.size()];
}

Style truth_style() {
  return {"#777", "", 4.0};
}

std::string stroke(const Style& style) {
  return "stroke=\"" + style.colour + "\" stroke-width=\"" + number(style.width_px, 1) + "\"" +
         (style.dash.empty() ? "" : " stroke-dasharray=\"" + style.dash + "\"");
}

std::vector<double> ticks(double low, double high, int wanted, bool is_log) {
  // Beyond the precision of a double no step moves a value on.
  constexpr int kMostSteps = 1000;
  std::vector<double> values;
  if (is_log) {
    const bool wide = high / low > 2e3;
    double decade = std::pow(10.0, std::floor(std::log10(low)));
    for (int i = 0; i < kMostSteps && decade <= high; ++i, decade *= 10.0) {
      for (const double m : {1.0, 2.0, 5.0}) {
        if (wide && m > 1.0) continue;
        if (m * decade >= low * 0.999 && m * decade <= high * 1.001) values.push_back(m * decade);
      }
    }
    return values;
  }
  const double raw = (high - low) / wanted, power = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10.0 * power;
  for (const double m : {5.0, 2.0, 1.0}) {
    if (m * power >= raw) step = m * power;
  }
  double v = std::ceil(low / step - 1e-9) * step;
  for (int i = 0; i < kMostSteps && v <= high + 1e-9 * step; ++i, v += step)
    values.push_back(std::abs(v) < 1e-9 * step ? 0.0 : v);
  return values;
}

void Plot::line(const std::string& name, std::vector<Eigen::Vector2d> points, const Style& style) {
  layers_.push_back({name, thinned(std::move(points)), style, true, false, 0.0});
}

void Plot::dots(const std::string& name, std::vector<Eigen::Vector2d> points, const std::string& colour,
                double side_px) {
  layers_.push_back({name, std::move(points), {colour, "", 1.0}, false, false, side_px});
}

void Plot::steps(const std::string& name, const std::vector<double>& edges, const std::vector<double>& values,
                 const Style& style) {
  std::vector<Eigen::Vector2d> points;
  points.emplace_back(edges.front(), 0.0);
  for (std::size_t i = 0; i < values.size(); ++i) {
    points.emplace_back(edges[i], values[i]);
    points.emplace_back(edges[i + 1], values[i]);
  }
  points.emplace_back(edges.back(), 0.0);
  layers_.push_back({name, std::move(points), style, true, false, 0.0});
}

void Plot::mark_x(const std::string& name, double x, const Style& style) {
  layers_.push_back({name, {{x, 0.0}}, style, true, true, 0.0});
}

double Plot::Scale::share(double value) const {
  if (!is_log) return (value - low) / (high - low);
  return (std::log(std::max(value, 1e-12)) - std::log(low)) / (std::log(high) - std::log(low));
}

Plot::Scale Plot::scale_of(const Axis& axis, int dimension) const {
  double low = 1e300, high = -1e300;
  for (const Layer& layer : layers_) {
    if (layer.is_mark && dimension == 1) continue;
    for (const Eigen::Vector2d& p : layer.points) {
      if (!std::isfinite(p[dimension]) || (axis.is_log && p[dimension] <= 0.0)) continue;
      low = std::min(low, p[dimension]);
      high = std::max(high, p[dimension]);
    }
  }
  if (low > high) low = axis.is_log ? 1.0 : 0.0, high = axis.is_log ? 10.0 : 1.0;
  const bool narrow = high - low < 1e-9 * std::max(1.0, std::abs(high));
  if (axis.is_log) {
    if (narrow) high = 2.0 * low;
  } else {
    const double margin = narrow ? 0.5 : 0.04 * (high - low);
    // Where the data begin at zero, so does the axis.
    low = low >= 0.0 && low < 0.3 * high ? 0.0 : low - margin;
    high += margin;
  }
  return {axis.low.value_or(low), axis.high.value_or(high), axis.is_log};
}

double Plot::legend_px() const {
  double rows = 0.0;
  for (const Layer& layer : layers_) rows += layer.name.empty() ? 0.0 : 1.0;
  return rows > 0.0 ? kLegendRow_px * std::ceil(rows / 2.0) + 4.0 : 0.0;
}

Eigen::Vector2d Plot::corner_px() const {
  return {kLeft_px, kTop_px};
}

Eigen::Vector2d Plot::area_px() const {
  return {frame_.width_px - kLeft_px - kRight_px, frame_.height_px - kTop_px - kBottom_px - legend_px()};
}

Eigen::Vector2d Plot::place(const Scale& x, const Scale& y, const Eigen::Vector2d& p) const {
  // Kept within reason: far outside the area numbers would only get long.
  const double u = std::clamp(x.share(p.x()), -2.0, 3.0), v = std::clamp(y.share(p.y()), -2.0, 3.0);
  return corner_px() + Eigen::Vector2d(u * area_px().x(), (1.0 - v) * area_px().y());
}

void Plot::draw_axes(const Scale& x, const Scale& y, Svg* svg) const {
  const Eigen::Vector2d corner = corner_px(), area = area_px();
  const double bottom = corner.y() + area.y();
  const std::vector<double> xs = ticks(x.low, x.high, 7, x.is_log), ys = ticks(y.low, y.high, 6, y.is_log);
  for (const double value : xs) {
    const double at = corner.x() + x.share(value) * area.x();
    svg->line({at, corner.y()}, {at, bottom}, "class=\"grid\"");
    svg->text({at, bottom + 15}, tick_text(value, xs.size() > 1 ? xs[1] - xs[0] : 1.0, x.is_log),
              Anchor::kMiddle);
  }
  for (const double value : ys) {
    const double at = bottom - y.share(value) * area.y();
    svg->line({corner.x(), at}, {corner.x() + area.x(), at}, "class=\"grid\"");
    svg->text({corner.x() - 6, at + 4}, tick_text(value, ys.size() > 1 ? ys[1] - ys[0] : 1.0, y.is_log),
              Anchor::kEnd);
  }
  svg->rectangle(corner, area, "class=\"frame\"");
  svg->text({corner.x() + 0.5 * area.x(), bottom + 34}, frame_.x.label, Anchor::kMiddle);
  svg->turned_text({14, corner.y() + 0.5 * area.y()}, frame_.y.label);
  svg->text({corner.x(), 18}, frame_.title, Anchor::kStart, "class=\"title\"");
}

void Plot::draw_layers(const Scale& x, const Scale& y, Svg* svg) const {
  svg->begin_clip(corner_px(), area_px());
  for (const Layer& layer : layers_) {
    if (layer.is_mark) {
      const double at = place(x, y, {layer.points[0].x(), y.low}).x();
      svg->line({at, corner_px().y()}, {at, corner_px().y() + area_px().y()}, stroke(layer.style));
      continue;
    }
    std::vector<Eigen::Vector2d> points;
    for (const Eigen::Vector2d& p : layer.points) {
      if (p.allFinite()) points.push_back(place(x, y, p));
    }
    if (layer.is_line)
      svg->polyline(points, stroke(layer.style));
    else
      svg->dots(points, layer.side_px, "fill=\"" + layer.style.colour + "\"");
  }
  svg->end_clip();
}

void Plot::draw_legend(Svg* svg) const {
  int n = 0;
  const double top = frame_.height_px - legend_px() + 10.0;
  for (const Layer& layer : layers_) {
    if (layer.name.empty()) continue;
    const Eigen::Vector2d at(kLeft_px + (n % 2) * 0.5 * area_px().x(), top + (n / 2) * kLegendRow_px);
    if (layer.is_line)
      svg->line(at, at + Eigen::Vector2d(30, 0), stroke(layer.style));
    else
      svg->rectangle(at + Eigen::Vector2d(12, -4), {8, 8}, "fill=\"" + layer.style.colour + "\"");
    svg->text(at + Eigen::Vector2d(36, 4), layer.name, Anchor::kStart);
    ++n;
  }
}

std::string Plot::svg() const {
  if (layers_.empty()) return {};
  Scale x = scale_of(frame_.x, 0), y = scale_of(frame_.y, 1);
  if (frame_.equal_units) {
    // The axis with room to spare is widened.
    const double x_unit = (x.high - x.low) / area_px().x(), y_unit = (y.high - y.low) / area_px().y();
    Scale& wider = x_unit < y_unit ? x : y;
    const double factor = x_unit < y_unit ? y_unit / x_unit : x_unit / y_unit;
    const double middle = 0.5 * (wider.low + wider.high), half = 0.5 * (wider.high - wider.low) * factor;
    wider.low = middle - half;
    wider.high = middle + half;
  }
  Svg svg(frame_.width_px, frame_.height_px);
  draw_axes(x, y, &svg);
  draw_layers(x, y, &svg);
  draw_legend(&svg);
  return svg.finish(frame_.title);
}

}  // namespace farpoint::tools::report
