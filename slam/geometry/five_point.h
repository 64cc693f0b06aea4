// SPDX-License-Identifier: Apache-2.0
// Minimal solver for the essential matrix.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>

namespace farpoint::slam {

struct EssentialCandidates {
  std::array<Eigen::Matrix3d, 10> matrix;  // Frobenius norm 1
  size_t count = 0;
};

// Essential matrices E with bearing_2^T E bearing_1 = 0 for five matches of unit bearings (any field of
// view). Nister, "An efficient solution to the five-point relative pose problem", PAMI 2004: null space,
// elimination to a 3x3 matrix of polynomials, real roots of its determinant of degree ten. No heap.
[[nodiscard]] EssentialCandidates solve_five_point(std::span<const Eigen::Vector3d, 5> bearings_1,
                                                   std::span<const Eigen::Vector3d, 5> bearings_2);

}  // namespace farpoint::slam
