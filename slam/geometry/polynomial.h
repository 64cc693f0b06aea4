// SPDX-License-Identifier: Apache-2.0
// Real roots of low-degree polynomials, for the minimal solvers.
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace farpoint::slam {

inline constexpr size_t kMaxPolynomialDegree = 10;

struct RealRoots {
  std::array<double, kMaxPolynomialDegree> value{};
  size_t count = 0;
};

// Real roots in [low, high] of c[0] + c[1] x + ... + c[degree] x^degree, ascending, each to about double
// precision. Finds every root at which the sign changes; a root of even multiplicity, where it does not, may
// be missed. No heap.
[[nodiscard]] RealRoots real_roots(std::span<const double> c, double low, double high);

// All real roots (in no order): those within [-1, 1] directly, the others as reciprocals of the reversed
// polynomial's.
[[nodiscard]] RealRoots real_roots(std::span<const double> c);

}  // namespace farpoint::slam
