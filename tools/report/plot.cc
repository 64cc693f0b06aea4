// SPDX-License-Identifier: Apache-2.0
#include "tools/report/plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "tools/report/colours.h"

namespace farpoint::tools::report {
namespace {

constexpr double kLeft_px = 62, kRight_px = 14, kTop_px = 30, kBottom_px = 44, kLegendRow_px = 17;
// Of a pixel: the script shows values to a hundredth of one, and zooms in 60 times.
constexpr int kDigits = 2;
constexpr double kLetter_px = 7.0, kLegendLine_px = 36;
// More points than this a line cannot show.
constexpr std::size_t kMostPoints = 1500;

std::string precise(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

// What the script needs to turn pixels into values.
std::string range_attribute(const char* name, const Scale& scale) {
  return std::string(" ") + name + "=\"" + precise(scale.low) + " " + precise(scale.high) +
         (scale.is_log ? " log\"" : " linear\"");
}

// Cuts a name to the given width.
std::string shortened(const std::string& text, double room_px) {
  const auto most = static_cast<std::size_t>(std::max(room_px / kLetter_px, 8.0));
  return text.size() <= most ? text : text.substr(0, most - 2) + "..";
}

}  // namespace

Style run_style(std::size_t n) {
  // Of falling lightness: they stay apart in grey too.
  static const std::array<Style, 5> kStyles = {
      Style{"#0b3c78", "", 2.2}, Style{"#d8702a", "7 3", 2.2}, Style{"#3d9970", "2 2.5", 2.4},
      Style{"#8e44ad", "9 3 2 3", 2.0}, Style{"#b0a000", "4 2 1 2", 2.0}};
  return kStyles[n % kStyles.size()];
}

Style thin_run_style(std::size_t n) {
  Style style = run_style(n);
  style.width_px = 0.9;
  return style;
}

Style truth_style() {
  return {"#777", "", 4.0};
}

std::string stroke(const Style& style) {
  return "stroke=\"" + style.colour + "\" stroke-width=\"" + number(style.width_px, 1) + "\"" +
         (style.dash.empty() ? "" : " stroke-dasharray=\"" + style.dash + "\"");
}

std::vector<Eigen::Vector2d> thinned(const std::vector<Eigen::Vector2d>& points, std::size_t most) {
  constexpr std::size_t kOfAStretch = 3;
  if (points.size() <= most || most == 0) return points;
  const std::size_t stretch = (kOfAStretch * points.size() + most - 1) / most;
  std::vector<Eigen::Vector2d> kept;
  for (std::size_t begin = 0; begin < points.size(); begin += stretch) {
    const std::size_t end = std::min(begin + stretch, points.size());
    std::size_t lowest = begin, highest = begin, broken = end;
    for (std::size_t i = begin; i < end; ++i) {
      if (!points[i].allFinite()) {
        broken = i;
        continue;
      }
      if (!(points[i].y() >= points[lowest].y())) lowest = i;
      if (!(points[i].y() <= points[highest].y())) highest = i;
    }
    std::array<std::size_t, 4> order = {begin, lowest, highest, broken};
    std::sort(order.begin(), order.end());
    for (std::size_t k = 0; k < order.size(); ++k) {
      if (order[k] < end && (k == 0 || order[k] != order[k - 1])) kept.push_back(points[order[k]]);
    }
  }
  kept.push_back(points.back());
  return kept;
}

void Plot::line(const std::string& name, const std::vector<Eigen::Vector2d>& points, const Style& style) {
  layers_.push_back({Kind::kLine, name, thinned(points, kMostPoints), style, 0.0, {}});
}

void Plot::dots(const std::string& name, std::vector<Eigen::Vector2d> points, const std::string& colour,
                double side_px) {
  layers_.push_back({Kind::kDots, name, std::move(points), {colour, "", 1.0}, side_px, {}});
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
  layers_.push_back({Kind::kLine, name, std::move(points), style, 0.0, {}});
}

void Plot::mark_x(const std::string& name, double x, const Style& style) {
  layers_.push_back({Kind::kMarkX, name, {{x, NAN}}, style, 0.0, {}});
}

void Plot::mark_y(const std::string& name, double y, const Style& style) {
  layers_.push_back({Kind::kMarkY, name, {{NAN, y}}, style, 0.0, {}});
}

void Plot::coloured_line(std::vector<Eigen::Vector2d> points, ColouredValues values) {
  layers_.push_back({Kind::kColoured, "", std::move(points), {"#000", "", 3.0}, 0.0, std::move(values)});
}

void Plot::label_point(const std::string& word, const Eigen::Vector2d& at) {
  layers_.push_back({Kind::kLabel, word, {at}, {"#000", "", 1.6}, 0.0, {}});
}

Plot::Scales Plot::scales() const {
  std::vector<double> xs, ys;
  for (const Layer& layer : layers_) {
    for (const Eigen::Vector2d& p : layer.points) {
      xs.push_back(p.x());
      ys.push_back(p.y());
    }
  }
  Scales scales{scale_around(frame_.x, xs, !frame_.equal_units),
                scale_around(frame_.y, ys, !frame_.equal_units)};
  if (!frame_.equal_units) return scales;
  // The axis with room to spare is widened.
  const double x_unit = (scales.x.high - scales.x.low) / area_px().x(),
               y_unit = (scales.y.high - scales.y.low) / area_px().y();
  Scale& wider = x_unit < y_unit ? scales.x : scales.y;
  const double factor = x_unit < y_unit ? y_unit / x_unit : x_unit / y_unit;
  const double middle = 0.5 * (wider.low + wider.high), half = 0.5 * (wider.high - wider.low) * factor;
  wider.low = middle - half;
  wider.high = middle + half;
  return scales;
}

bool Plot::shows_something(const Scales& scales) const {
  const auto is_inside = [&](const Eigen::Vector2d& p) {
    return scales.x.holds(p.x()) && scales.y.holds(p.y());
  };
  return std::any_of(layers_.begin(), layers_.end(), [&](const Layer& layer) {
    if (layer.kind == Kind::kMarkX || layer.kind == Kind::kMarkY || layer.kind == Kind::kLabel) return false;
    const auto inside = std::count_if(layer.points.begin(), layer.points.end(), is_inside);
    return inside >= (layer.kind == Kind::kDots ? 1 : 2);
  });
}

std::vector<const Plot::Layer*> Plot::named_layers() const {
  const auto is_drawn = [](const Layer& layer) {
    return std::any_of(layer.points.begin(), layer.points.end(),
                       [](const Eigen::Vector2d& p) { return std::isfinite(p.x()) || std::isfinite(p.y()); });
  };
  std::vector<const Layer*> named;
  for (const Layer& layer : layers_) {
    if (!layer.name.empty() && layer.kind != Kind::kLabel && is_drawn(layer)) named.push_back(&layer);
  }
  return named;
}

const Plot::Layer* Plot::coloured_layer() const {
  for (const Layer& layer : layers_) {
    if (layer.kind == Kind::kColoured) return &layer;
  }
  return nullptr;
}

double Plot::width_px() const {
  return frame_.width_px - kLeft_px - kRight_px;
}

int Plot::legend_columns() const {
  std::size_t longest = 0;
  for (const Layer* layer : named_layers()) longest = std::max(longest, layer->name.size());
  return kLegendLine_px + kLetter_px * static_cast<double>(longest) < 0.5 * width_px() ? 2 : 1;
}

double Plot::legend_px() const {
  double rows = std::ceil(static_cast<double>(named_layers().size()) / legend_columns());
  if (coloured_layer() != nullptr) rows += 2.0;
  return rows > 0.0 ? kLegendRow_px * rows + 4.0 : 0.0;
}

Eigen::Vector2d Plot::corner_px() const {
  return {kLeft_px, kTop_px};
}

Eigen::Vector2d Plot::area_px() const {
  return {width_px(), frame_.height_px - kTop_px - kBottom_px - legend_px()};
}

Eigen::Vector2d Plot::place(const Scales& scales, const Eigen::Vector2d& p) const {
  // Kept within reason: far outside the area numbers would only get long.
  const double u = std::clamp(scales.x.share(p.x()), -2.0, 3.0),
               v = std::clamp(scales.y.share(p.y()), -2.0, 3.0);
  return corner_px() + Eigen::Vector2d(u * area_px().x(), (1.0 - v) * area_px().y());
}

void Plot::draw_axes(const Scales& scales, Svg* svg) const {
  const Eigen::Vector2d corner = corner_px(), area = area_px();
  const double bottom = corner.y() + area.y();
  const auto step_of = [](const std::vector<double>& values) {
    return values.size() > 1 ? values[1] - values[0] : 1.0;
  };
  const std::vector<double> xs = ticks(scales.x.low, scales.x.high, 7, scales.x.is_log),
                            ys = ticks(scales.y.low, scales.y.high, 6, scales.y.is_log);
  svg->begin_group("class=\"ticks\"");
  for (const double value : xs) {
    const double at = corner.x() + scales.x.share(value) * area.x();
    svg->line({at, corner.y()}, {at, bottom}, "class=\"grid\"");
    svg->text({at, bottom + 15}, tick_text(value, step_of(xs), scales.x.is_log), Anchor::kMiddle);
  }
  for (const double value : ys) {
    const double at = bottom - scales.y.share(value) * area.y();
    svg->line({corner.x(), at}, {corner.x() + area.x(), at}, "class=\"grid\"");
    svg->text({corner.x() - 6, at + 4}, tick_text(value, step_of(ys), scales.y.is_log), Anchor::kEnd);
  }
  svg->end_group();
  svg->rectangle(corner, area, "class=\"frame\"");
  svg->text({corner.x() + 0.5 * area.x(), bottom + 34}, frame_.x.label, Anchor::kMiddle);
  svg->turned_text({14, corner.y() + 0.5 * area.y()}, frame_.y.label);
  svg->text({corner.x(), 18}, frame_.title, Anchor::kStart, "class=\"title\"");
}

void Plot::draw_line(const Layer& layer, const Scales& scales, Svg* svg) const {
  const std::string attributes = stroke(layer.style) + " data-name=\"" + escaped(layer.name) + "\"";
  std::vector<Eigen::Vector2d> piece;
  for (const Eigen::Vector2d& p : layer.points) {
    if (p.allFinite()) {
      piece.push_back(place(scales, p));
      continue;
    }
    svg->polyline(piece, attributes, kDigits);
    piece.clear();
  }
  svg->polyline(piece, attributes, kDigits);
}

// Neighbouring pieces of one level are one element.
void Plot::draw_coloured(const Layer& layer, const Scales& scales, Svg* svg) const {
  std::vector<Eigen::Vector2d> piece;
  std::string values;
  int level = 0;
  const auto add = [&](const Eigen::Vector2d& at, double value) {
    piece.push_back(at);
    if (!values.empty()) values += ' ';
    values += number(value, 4);
  };
  const auto finish = [&] {
    svg->polyline(piece,
                  stroke({level_colour(level), "", layer.style.width_px}) +
                      " stroke-linecap=\"round\" data-name=\"" + escaped(layer.colours.label) +
                      "\" data-values=\"" + values + "\"",
                  kDigits);
    piece.clear();
    values.clear();
  };
  for (std::size_t i = 0; i < std::min(layer.points.size(), layer.colours.values.size()); ++i) {
    if (!layer.points[i].allFinite()) {
      finish();
      continue;
    }
    const Eigen::Vector2d at = place(scales, layer.points[i]);
    const double value = layer.colours.values[i];
    add(at, value);
    const int next = colour_level(value, layer.colours.low, layer.colours.high);
    if (next == level) continue;
    finish();
    add(at, value);
    level = next;
  }
  finish();
}

void Plot::draw_layer(const Layer& layer, const Scales& scales, Svg* svg) const {
  const Eigen::Vector2d corner = corner_px(), end = corner_px() + area_px();
  switch (layer.kind) {
    case Kind::kLine:
      return draw_line(layer, scales, svg);
    case Kind::kColoured:
      return draw_coloured(layer, scales, svg);
    case Kind::kMarkX: {
      const double at = place(scales, {layer.points[0].x(), scales.y.low}).x();
      return svg->line({at, corner.y()}, {at, end.y()}, stroke(layer.style));
    }
    case Kind::kMarkY: {
      const double at = place(scales, {scales.x.low, layer.points[0].y()}).y();
      return svg->line({corner.x(), at}, {end.x(), at}, stroke(layer.style));
    }
    case Kind::kLabel: {
      if (!layer.points[0].allFinite()) return;
      const Eigen::Vector2d at = place(scales, layer.points[0]);
      svg->begin_group("class=\"label\" data-at=\"" + number(at.x()) + "," + number(at.y()) + "\"");
      svg->circle(at, 5.0, "fill=\"#fff\" " + stroke(layer.style));
      const bool is_right = at.x() + kLetter_px * static_cast<double>(layer.name.size()) + 12.0 > end.x();
      svg->text(at + Eigen::Vector2d(is_right ? -9 : 9, at.y() < corner.y() + 20.0 ? 16 : -6), layer.name,
                is_right ? Anchor::kEnd : Anchor::kStart, "class=\"mark\"");
      return svg->end_group();
    }
    case Kind::kDots: {
      std::vector<Eigen::Vector2d> points;
      for (const Eigen::Vector2d& p : layer.points) {
        if (p.allFinite()) points.push_back(place(scales, p));
      }
      return svg->dots(points, layer.side_px, layer.style.colour);
    }
  }
}

void Plot::draw_layers(const Scales& scales, Svg* svg) const {
  svg->begin_clip(corner_px(), area_px());
  for (const Layer& layer : layers_) draw_layer(layer, scales, svg);
  svg->end_clip();
}

void Plot::draw_colour_bar(const Layer& layer, double top_px, Svg* svg) const {
  constexpr double kBox_px = 13;
  const double bar_px = kBox_px * kColourLevels;
  for (int i = 0; i < kColourLevels; ++i)
    svg->rectangle({kLeft_px + kBox_px * i, top_px}, {kBox_px + 0.5, 9}, "fill=\"" + level_colour(i) + "\"");
  const double step = (layer.colours.high - layer.colours.low) / 10.0;
  svg->text({kLeft_px, top_px + 22}, tick_text(layer.colours.low, step, false), Anchor::kStart);
  svg->text({kLeft_px + bar_px, top_px + 22}, tick_text(layer.colours.high, step, false) + " and more",
            Anchor::kMiddle);
  svg->text({kLeft_px + bar_px + 12, top_px + 9}, layer.colours.label, Anchor::kStart);
}

void Plot::draw_legend(Svg* svg) const {
  double top = frame_.height_px - legend_px() + 10.0;
  const int columns = legend_columns();
  const double room_px = width_px() / columns;
  int n = 0;
  for (const Layer* layer : named_layers()) {
    const int row = n / columns, column = n % columns;
    const Eigen::Vector2d at(kLeft_px + column * room_px, top + row * kLegendRow_px);
    if (layer->kind == Kind::kDots)
      svg->rectangle(at + Eigen::Vector2d(12, -4), {8, 8}, "fill=\"" + layer->style.colour + "\"");
    else
      svg->line(at, at + Eigen::Vector2d(30, 0), stroke(layer->style));
    svg->text(at + Eigen::Vector2d(kLegendLine_px, 4), shortened(layer->name, room_px - kLegendLine_px),
              Anchor::kStart);
    ++n;
  }
  const int rows = (n + columns - 1) / columns;
  top += kLegendRow_px * rows;
  if (const Layer* layer = coloured_layer()) draw_colour_bar(*layer, top - 4.0, svg);
}

std::string Plot::svg() const {
  const Scales ranges = scales();
  if (!shows_something(ranges)) return {};
  Svg svg(frame_.width_px, frame_.height_px);
  draw_axes(ranges, &svg);
  draw_layers(ranges, &svg);
  draw_legend(&svg);
  return svg.finish(frame_.title, range_attribute("data-x", ranges.x) + range_attribute("data-y", ranges.y) +
                                      (frame_.equal_units ? " data-equal=\"1\"" : ""));
}

}  // namespace farpoint::tools::report
