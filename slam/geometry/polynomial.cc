// SPDX-License-Identifier: Apache-2.0
#include "slam/geometry/polynomial.h"

#include <algorithm>
#include <cmath>

namespace farpoint::slam {

namespace {

using Coefficients = std::array<double, kMaxPolynomialDegree + 1>;

double evaluate(const Coefficients& c, size_t degree, double x) {
  double value = c[degree];
  for (size_t i = degree; i-- > 0;) value = value * x + c[i];
  return value;
}

// The root between low and high, where the signs differ: Newton, or halving the bracket where Newton leaves
// it or does not at least halve its step.
double bracketed_root(const Coefficients& c, const Coefficients& derivative, size_t degree, double low,
                      double high, double tolerance) {
  const bool rising = evaluate(c, degree, low) < 0.0;
  double x = 0.5 * (low + high);
  double last_step = high - low;
  for (int i = 0; i < 100; ++i) {
    const double value = evaluate(c, degree, x);
    if (value == 0.0) return x;
    ((value < 0.0) == rising ? low : high) = x;
    double next = x - value / evaluate(derivative, degree - 1, x);
    if (!(next > low && next < high) || std::abs(next - x) > 0.5 * last_step) next = 0.5 * (low + high);
    last_step = std::abs(next - x);
    x = next;
    if (last_step <= tolerance * (1.0 + std::abs(x))) break;
  }
  return x;
}

// A root of a derivative only separates the roots of the polynomial above it and need not be sharp.
constexpr double kRootTolerance = 1e-14;
constexpr double kSeparatorTolerance = 1e-9;

}  // namespace

RealRoots real_roots(std::span<const double> c, double low, double high) {
  size_t degree = std::min(c.size() - 1, kMaxPolynomialDegree);
  while (degree > 0 && c[degree] == 0.0) --degree;
  RealRoots roots;
  if (degree == 0) return roots;
  // derivative[k] is the k-th derivative, of degree - k.
  std::array<Coefficients, kMaxPolynomialDegree + 1> derivative{};
  std::copy_n(c.begin(), degree + 1, derivative[0].begin());
  for (size_t k = 1; k <= degree; ++k) {
    for (size_t i = 0; i + k <= degree; ++i) {
      derivative[k][i] = static_cast<double>(i + 1) * derivative[k - 1][i + 1];
    }
  }
  // Between neighbouring roots of its derivative a polynomial is monotonic and has at most one root: climb
  // from the linear derivative up to the polynomial itself.
  for (size_t k = degree; k-- > 0;) {
    RealRoots found;
    double left = low;
    double left_value = evaluate(derivative[k], degree - k, left);
    for (size_t i = 0; i <= roots.count; ++i) {
      const double right = i < roots.count ? roots.value[i] : high;
      const double right_value = evaluate(derivative[k], degree - k, right);
      if ((left_value < 0.0) != (right_value < 0.0) && found.count < degree - k) {
        found.value[found.count++] = bracketed_root(derivative[k], derivative[k + 1], degree - k, left, right,
                                                    k == 0 ? kRootTolerance : kSeparatorTolerance);
      }
      left = right;
      left_value = right_value;
    }
    roots = found;
  }
  return roots;
}

RealRoots real_roots(std::span<const double> c) {
  const size_t size = std::min(c.size(), kMaxPolynomialDegree + 1);
  RealRoots roots = real_roots(c.first(size), -1.0, 1.0);
  Coefficients reversed{};
  std::reverse_copy(c.begin(), c.begin() + static_cast<std::ptrdiff_t>(size), reversed.begin());
  const RealRoots outer = real_roots(std::span<const double>(reversed).first(size), -1.0, 1.0);
  for (size_t i = 0; i < outer.count && roots.count < kMaxPolynomialDegree; ++i) {
    const double x = outer.value[i];
    if (std::abs(x) > 1e-12 && std::abs(x) < 1.0) roots.value[roots.count++] = 1.0 / x;
  }
  return roots;
}

}  // namespace farpoint::slam
