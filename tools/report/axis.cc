// SPDX-License-Identifier: Apache-2.0
#include "tools/report/axis.h"

#include <algorithm>
#include <cmath>

#include "tools/report/svg.h"

namespace farpoint::tools::report {
namespace {

// Beyond the precision of a double no step moves a value on.
constexpr int kMostSteps = 1000;

std::vector<double> decade_ticks(double low, double high) {
  std::vector<double> values;
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

// Steps of equal size crowd at the upper end of a logarithmic axis: those too near to the one before are left
// out, so that each label has its room.
std::vector<double> apart(const std::vector<double>& values, double low, double high, int wanted) {
  const double room = std::log(high / low) / (2.0 * wanted);
  std::vector<double> kept;
  for (const double v : values)
    if (kept.empty() || std::log(v / kept.back()) >= room) kept.push_back(v);
  return kept;
}

}  // namespace

double Scale::share(double value) const {
  if (!is_log) return (value - low) / (high - low);
  return (std::log(std::max(value, 1e-12)) - std::log(low)) / (std::log(high) - std::log(low));
}

bool Scale::holds(double value) const {
  return value >= low && value <= high;  // NaN: false
}

Scale scale_around(const Axis& axis, const std::vector<double>& values, bool from_zero) {
  double low = 1e300, high = -1e300;
  for (const double value : values) {
    if (!std::isfinite(value) || (axis.is_log && value <= 0.0)) continue;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  if (low > high) low = axis.is_log ? 1.0 : 0.0, high = axis.is_log ? 10.0 : 1.0;
  const bool narrow = high - low < 1e-9 * std::max(1.0, std::abs(high));
  if (axis.is_log) {
    constexpr double kMargin = 1.08;
    low /= narrow ? 2.0 : kMargin;
    high *= narrow ? 2.0 : kMargin;
  } else {
    const bool is_from_zero = from_zero && low >= 0.0 && low < 0.3 * high;
    if (is_from_zero) low = 0.0;
    // Of the whole axis, so that lines far above zero do not lie on the frame.
    const double margin = narrow ? 0.5 : 0.04 * std::max(high - axis.low.value_or(low), 0.0);
    if (!is_from_zero) low -= margin;
    high += margin;
  }
  return {axis.low.value_or(low), axis.high.value_or(high), axis.is_log};
}

std::vector<double> ticks(double low, double high, int wanted, bool is_log) {
  constexpr std::size_t kFewest = 4;
  if (is_log) {
    std::vector<double> values = decade_ticks(low, high);
    if (values.size() >= kFewest) return values;
    wanted *= 2;  // some are left out below
  }
  std::vector<double> values;
  const double raw = (high - low) / wanted, power = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10.0 * power;
  for (const double m : {5.0, 2.0, 1.0}) {
    if (m * power >= raw) step = m * power;
  }
  double v = std::ceil(low / step - 1e-9) * step;
  for (int i = 0; i < kMostSteps && v <= high + 1e-9 * step; ++i, v += step)
    values.push_back(std::abs(v) < 1e-9 * step ? 0.0 : v);
  return is_log ? apart(values, low, high, wanted / 2) : values;
}

std::string tick_text(double value, double step, bool is_log) {
  constexpr int kMostDigits = 6;
  const double finest = is_log ? std::min(step, value) : step;
  if (!(finest > 0.0) || finest >= 1.0) return number(value, finest < 10.0 && is_log ? 1 : 0);
  const double digits = std::ceil(-std::log10(finest) - 1e-9);
  return number(value, digits < kMostDigits ? static_cast<int>(digits) : kMostDigits);
}

}  // namespace farpoint::tools::report
