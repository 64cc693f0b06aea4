// SPDX-License-Identifier: Apache-2.0
#include "slam/geometry/five_point.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>

#include "slam/geometry/polynomial.h"

namespace farpoint::slam {

namespace {

// Polynomials in x, y, z of degree 1, 2 and 3 as coefficient rows. The order of the cubic monomials is
// Nister's: the first ten are eliminated, what stays is linear in x and y.
struct Monomial {
  int x, y, z;
};
constexpr std::array<Monomial, 4> kLinear = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};
constexpr std::array<Monomial, 10> kQuadratic = {{{2, 0, 0},
                                                  {0, 2, 0},
                                                  {0, 0, 2},
                                                  {1, 1, 0},
                                                  {1, 0, 1},
                                                  {0, 1, 1},
                                                  {1, 0, 0},
                                                  {0, 1, 0},
                                                  {0, 0, 1},
                                                  {0, 0, 0}}};
constexpr std::array<Monomial, 20> kCubic = {{{3, 0, 0}, {0, 3, 0}, {2, 1, 0}, {1, 2, 0}, {2, 0, 1},
                                              {2, 0, 0}, {0, 2, 1}, {0, 2, 0}, {1, 1, 1}, {1, 1, 0},
                                              {1, 0, 2}, {1, 0, 1}, {1, 0, 0}, {0, 1, 2}, {0, 1, 1},
                                              {0, 1, 0}, {0, 0, 3}, {0, 0, 2}, {0, 0, 1}, {0, 0, 0}}};

// table[i][k]: index in `result` of the product of the i-th monomial of `left` and the k-th of `right`.
template <size_t L, size_t R, size_t N>
constexpr std::array<std::array<int, R>, L> product_table(const std::array<Monomial, L>& left,
                                                          const std::array<Monomial, R>& right,
                                                          const std::array<Monomial, N>& result) {
  std::array<std::array<int, R>, L> table{};
  for (size_t i = 0; i < L; ++i) {
    for (size_t k = 0; k < R; ++k) {
      for (size_t n = 0; n < N; ++n) {
        if (result[n].x == left[i].x + right[k].x && result[n].y == left[i].y + right[k].y &&
            result[n].z == left[i].z + right[k].z) {
          table[i][k] = static_cast<int>(n);
        }
      }
    }
  }
  return table;
}
constexpr auto kLinearTimesLinear = product_table(kLinear, kLinear, kQuadratic);
constexpr auto kQuadraticTimesLinear = product_table(kQuadratic, kLinear, kCubic);

using Linear = std::array<double, 4>;
using Quadratic = std::array<double, 10>;
using Cubic = std::array<double, 20>;

void add_product(const Linear& a, const Linear& b, double factor, Quadratic* sum) {
  for (size_t i = 0; i < 4; ++i) {
    for (size_t k = 0; k < 4; ++k)
      (*sum)[static_cast<size_t>(kLinearTimesLinear[i][k])] += factor * a[i] * b[k];
  }
}

void add_product(const Quadratic& a, const Linear& b, Cubic* sum) {
  for (size_t i = 0; i < 10; ++i) {
    for (size_t k = 0; k < 4; ++k) (*sum)[static_cast<size_t>(kQuadraticTimesLinear[i][k])] += a[i] * b[k];
  }
}

using LinearMatrix = std::array<std::array<Linear, 3>, 3>;
using ConstraintMatrix = Eigen::Matrix<double, 10, 20, Eigen::RowMajor>;

void set_row(const Cubic& cubic, int row, ConstraintMatrix* m) {
  for (int i = 0; i < 20; ++i) (*m)(row, i) = cubic[static_cast<size_t>(i)];
}

// The ten cubic constraints on e = x X + y Y + z Z + W: det E = 0 and (E E^T - 1/2 trace(E E^T) I) E = 0.
ConstraintMatrix essential_constraints(const LinearMatrix& e) {
  ConstraintMatrix m;
  std::array<std::array<Quadratic, 3>, 3> eet{};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t k = i; k < 3; ++k) {
      for (size_t n = 0; n < 3; ++n) add_product(e[i][n], e[k][n], 1.0, &eet[i][k]);
      eet[k][i] = eet[i][k];
    }
  }
  for (size_t n = 0; n < 10; ++n) {
    const double half_trace = 0.5 * (eet[0][0][n] + eet[1][1][n] + eet[2][2][n]);
    for (size_t i = 0; i < 3; ++i) eet[i][i][n] -= half_trace;
  }
  int row = 0;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t k = 0; k < 3; ++k) {
      Cubic cubic{};
      for (size_t n = 0; n < 3; ++n) add_product(eet[i][n], e[n][k], &cubic);
      set_row(cubic, row++, &m);
    }
  }
  Cubic determinant{};
  for (size_t i = 0; i < 3; ++i) {
    const size_t k = (i + 1) % 3, n = (i + 2) % 3;
    Quadratic minor{};
    add_product(e[1][k], e[2][n], 1.0, &minor);
    add_product(e[1][n], e[2][k], -1.0, &minor);
    add_product(minor, e[0][i], &determinant);
  }
  set_row(determinant, row, &m);
  return m;
}

// Polynomial in z, coefficients ascending; entries of B(z) have degree 3 (columns x, y) and 4 (column 1).
using ZPolynomial = std::array<double, 11>;

void add_product(const ZPolynomial& a, const ZPolynomial& b, double factor, ZPolynomial* sum) {
  for (size_t i = 0; i <= 10; ++i) {
    if (a[i] == 0.0) continue;
    for (size_t k = 0; i + k <= 10; ++k) (*sum)[i + k] += factor * a[i] * b[k];
  }
}

double evaluate(const ZPolynomial& p, double z) {
  return p[0] + z * (p[1] + z * (p[2] + z * (p[3] + z * p[4])));
}

using ZMatrix = std::array<std::array<ZPolynomial, 3>, 3>;
using Eliminated = Eigen::Matrix<double, 10, 10>;

// B(z) (x y 1)^T = 0. Row r comes from the eliminated rows of (monomial times z) and (monomial), x^2, y^2 and
// xy in turn: the first minus z times the second cancels the leading terms.
ZMatrix remaining_matrix(const Eliminated& g) {
  ZMatrix b{};
  for (size_t r = 0; r < 3; ++r) {
    const Eigen::Index with_z = static_cast<Eigen::Index>(4 + 2 * r), without_z = with_z + 1;
    const auto fill = [&](size_t column, Eigen::Index first, size_t terms) {
      for (size_t i = 0; i < terms; ++i) {
        const Eigen::Index source = first + static_cast<Eigen::Index>(i);
        const size_t power = terms - 1 - i;
        b[r][column][power] += g(with_z, source);
        b[r][column][power + 1] -= g(without_z, source);
      }
    };
    fill(0, 0, 3);
    fill(1, 3, 3);
    fill(2, 6, 4);
  }
  return b;
}

ZPolynomial determinant(const ZMatrix& b) {
  ZPolynomial det{};
  for (size_t i = 0; i < 3; ++i) {
    const size_t k = (i + 1) % 3, n = (i + 2) % 3;
    ZPolynomial minor{};
    add_product(b[1][k], b[2][n], 1.0, &minor);
    add_product(b[1][n], b[2][k], -1.0, &minor);
    add_product(b[0][i], minor, 1.0, &det);
  }
  return det;
}

// Null vector (x y 1) of B(z): the longest of the cross products of its rows. False where it lies at
// infinity.
bool solve_x_y(const ZMatrix& b, double z, double* x, double* y) {
  Eigen::Matrix3d m;
  for (size_t r = 0; r < 3; ++r) {
    for (size_t c = 0; c < 3; ++c) {
      m(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = evaluate(b[r][c], z);
    }
    m.row(static_cast<Eigen::Index>(r)).normalize();
  }
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Eigen::Vector3d v = m.row(i).transpose().cross(m.row((i + 1) % 3).transpose());
    if (v.squaredNorm() > best.squaredNorm()) best = v;
  }
  *x = best.x() / best.z();
  *y = best.y() / best.z();
  return std::isfinite(*x) && std::isfinite(*y);
}

}  // namespace

EssentialCandidates solve_five_point(std::span<const Eigen::Vector3d, 5> bearings_1,
                                     std::span<const Eigen::Vector3d, 5> bearings_2) {
  EssentialCandidates result;
  // Columns: the equations bearing_2^T E bearing_1 = 0 on E's entries, column by column.
  Eigen::Matrix<double, 9, 5> equations;
  for (Eigen::Index i = 0; i < 5; ++i) {
    const size_t s = static_cast<size_t>(i);
    for (Eigen::Index c = 0; c < 3; ++c) equations.block<3, 1>(3 * c, i) = bearings_1[s](c) * bearings_2[s];
  }
  const Eigen::HouseholderQR<Eigen::Matrix<double, 9, 5>> qr(equations);
  Eigen::Matrix<double, 9, 4> null_space = Eigen::Matrix<double, 9, 4>::Zero();
  null_space.bottomRows<4>().setIdentity();
  null_space.applyOnTheLeft(qr.householderQ());

  LinearMatrix e;
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      for (Eigen::Index n = 0; n < 4; ++n) {
        e[static_cast<size_t>(i)][static_cast<size_t>(k)][static_cast<size_t>(n)] = null_space(3 * k + i, n);
      }
    }
  }
  const ConstraintMatrix m = essential_constraints(e);
  const Eigen::PartialPivLU<Eliminated> lu(Eliminated(m.leftCols<10>()));
  const Eliminated g = lu.solve(Eliminated(m.rightCols<10>()));
  if (!g.allFinite()) return result;
  const ZMatrix b = remaining_matrix(g);
  const RealRoots roots = real_roots(determinant(b));
  for (size_t i = 0; i < roots.count; ++i) {
    const double z = roots.value[i];
    double x = 0.0, y = 0.0;
    if (!solve_x_y(b, z, &x, &y)) continue;
    const Eigen::Matrix<double, 9, 1> v = null_space * Eigen::Vector4d(x, y, z, 1.0);
    result.matrix[result.count++] = Eigen::Map<const Eigen::Matrix3d>(v.data()) / v.norm();
  }
  return result;
}

}  // namespace farpoint::slam
