// SPDX-License-Identifier: Apache-2.0
#include "tools/report/svg.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <initializer_list>

namespace farpoint::tools::report {
namespace {

std::string joined(std::initializer_list<std::string_view> parts) {
  std::string out;
  for (const std::string_view part : parts) out += part;
  return out;
}

std::string attribute(const char* name, double value) {
  return joined({" ", name, "=\"", number(value, 1), "\""});
}

std::string pair_text(const Eigen::Vector2d& p, int digits = 1) {
  return joined({number(p.x(), digits), ",", number(p.y(), digits)});
}

const char* to_string(Anchor anchor) {
  switch (anchor) {
    case Anchor::kStart:
      return "start";
    case Anchor::kMiddle:
      return "middle";
    default:
      return "end";
  }
}

std::string base64(const std::vector<std::uint8_t>& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (i + k < bytes.size() ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      out += i + k <= bytes.size() ? kDigits[word >> (18 - 6 * k) & 63U] : '=';
  }
  return out;
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

std::string number(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  std::string out = text;
  if (out.find('.') != std::string::npos) {
    while (out.back() == '0') out.pop_back();
    if (out.back() == '.') out.pop_back();
  }
  return out == "-0" ? "0" : out;
}

void Svg::line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, std::string_view attributes) {
  body_ += joined({"<line", attribute("x1", a.x()), attribute("y1", a.y()), attribute("x2", b.x()),
                   attribute("y2", b.y()), " ", attributes, "/>\n"});
}

void Svg::polyline(const std::vector<Eigen::Vector2d>& points, std::string_view attributes, int digits) {
  if (points.size() < 2) return;
  body_ += "<polyline fill=\"none\" points=\"";
  for (const Eigen::Vector2d& p : points) body_ += joined({pair_text(p, digits), " "});
  body_ += joined({"\" ", attributes, "/>\n"});
}

void Svg::rectangle(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, std::string_view attributes) {
  body_ += joined({"<rect", attribute("x", corner.x()), attribute("y", corner.y()),
                   attribute("width", size.x()), attribute("height", size.y()), " ", attributes, "/>\n"});
}

void Svg::circle(const Eigen::Vector2d& centre, double radius_px, std::string_view attributes) {
  body_ += joined({"<circle", attribute("cx", centre.x()), attribute("cy", centre.y()),
                   attribute("r", radius_px), " ", attributes, "/>\n"});
}

void Svg::text(const Eigen::Vector2d& at, std::string_view text, Anchor anchor, std::string_view attributes) {
  body_ += joined({"<text", attribute("x", at.x()), attribute("y", at.y()), " text-anchor=\"",
                   to_string(anchor), "\" ", attributes, ">", escaped(text), "</text>\n"});
}

void Svg::turned_text(const Eigen::Vector2d& at, std::string_view text) {
  body_ += joined({"<text transform=\"translate(", pair_text(at), ") rotate(-90)\" text-anchor=\"middle\">",
                   escaped(text), "</text>\n"});
}

// Each is a stroke without length, whose square cap is drawn.
void Svg::dots(const std::vector<Eigen::Vector2d>& points, double side_px, std::string_view colour) {
  if (points.empty()) return;
  body_ += joined({"<path stroke=\"", colour, "\" stroke-width=\"", number(side_px, 1),
                   "\" stroke-linecap=\"square\" d=\""});
  for (const Eigen::Vector2d& p : points) body_ += joined({"M", pair_text(p, 2), "h0"});
  body_ += "\"/>\n";
}

void Svg::jpeg(const std::vector<std::uint8_t>& bytes, double width_px, double height_px) {
  body_ += joined({"<image", attribute("width", width_px), attribute("height", height_px),
                   " href=\"data:image/jpeg;base64,", base64(bytes), "\"/>\n"});
}

// A drawing within the drawing, which cuts off by itself: clip paths would need ids that the page has once.
void Svg::begin_clip(const Eigen::Vector2d& corner, const Eigen::Vector2d& size) {
  body_ += joined({"<svg class=\"area\" preserveAspectRatio=\"none\"", attribute("x", corner.x()),
                   attribute("y", corner.y()), attribute("width", size.x()), attribute("height", size.y()),
                   " viewBox=\"", number(corner.x(), 1), " ", number(corner.y(), 1), " ", number(size.x(), 1),
                   " ", number(size.y(), 1), "\">\n"});
}

void Svg::begin_group(std::string_view attributes) {
  body_ += joined({"<g ", attributes, ">\n"});
}

void Svg::end_group() {
  body_ += "</g>\n";
}

void Svg::end_clip() {
  body_ += "</svg>\n";
}

std::string Svg::finish(std::string_view title, std::string_view attributes) const {
  const std::string width = number(width_px_, 0), height = number(height_px_, 0);
  return joined({"<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" width=\"", width, "\" height=\"",
                 height, "\" viewBox=\"0 0 ", width, " ", height, "\"", attributes, "><title>",
                 escaped(title), "</title>\n", body_, "</svg>\n"});
}

}  // namespace farpoint::tools::report
