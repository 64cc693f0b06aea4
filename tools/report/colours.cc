// SPDX-License-Identifier: Apache-2.0
#include "tools/report/colours.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace farpoint::tools::report {
namespace {

struct Colour {
  double red, green, blue;  // 0 .. 255
};
// Of rising lightness; the last one stays visible on white.
constexpr std::array kStops = {Colour{36, 24, 96}, Colour{36, 82, 138}, Colour{28, 132, 128},
                               Colour{92, 176, 84}, Colour{235, 196, 30}};

}  // namespace

int colour_level(double value, double low, double high) {
  const double share = high > low ? (value - low) / (high - low) : 0.0;
  if (!(share > 0.0)) return 0;
  return std::min(static_cast<int>(std::min(share, 1.0) * kColourLevels), kColourLevels - 1);
}

std::string level_colour(int level) {
  const double at = static_cast<double>(level) / (kColourLevels - 1) * (kStops.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), kStops.size() - 2);
  const double share = at - static_cast<double>(i);
  const auto mixed = [&](double Colour::*part) {
    return static_cast<int>(std::lround((1.0 - share) * kStops[i].*part + share * kStops[i + 1].*part));
  };
  char text[8];
  std::snprintf(text, sizeof text, "#%02x%02x%02x", static_cast<unsigned>(mixed(&Colour::red)) & 255U,
                static_cast<unsigned>(mixed(&Colour::green)) & 255U,
                static_cast<unsigned>(mixed(&Colour::blue)) & 255U);
  return text;
}

}  // namespace farpoint::tools::report
