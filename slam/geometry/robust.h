// SPDX-License-Identifier: Apache-2.0
// Robust costs: quantiles that tell outliers, and Huber's loss.
#pragma once

#include <cmath>

namespace farpoint::slam {

// Quantiles of chi-square, for squared residuals in sigmas.
inline constexpr double kChi2OneDof50 = 0.455;    // the median
inline constexpr double kChi2OneDof99 = 6.63;     // 99 %
inline constexpr double kChi2TwoDof = 5.991;      // 95 %; beyond it, a measurement of a pixel is an outlier
inline constexpr double kChi2TwoDof99 = 9.21;     // 99 %
inline constexpr double kChi2TwoDof999 = 13.816;  // 99.9 %

// Where Huber's loss of |r| turns linear, in sigmas.
inline constexpr double kHuberDelta = 2.4477;       // of two numbers: sqrt(kChi2TwoDof)
inline constexpr double kHuberDeltaOneDof = 1.345;  // of one number: 95 % efficiency for Gaussian noise

// Huber's loss of |r| and the weight of r'r that has the same gradient. `squared` is r'r.
[[nodiscard]] inline double huber_cost(double squared, double delta = kHuberDelta) {
  const double r = std::sqrt(squared);
  return r <= delta ? 0.5 * squared : delta * (r - 0.5 * delta);
}
[[nodiscard]] inline double huber_weight(double squared, double delta = kHuberDelta) {
  const double r = std::sqrt(squared);
  return r <= delta ? 1.0 : delta / r;
}

}  // namespace farpoint::slam
