// SPDX-License-Identifier: Apache-2.0
// What the solvers on the Schur complement share: pose derivatives in world axes, and the blocks of the
// normal equations.
//
// Pose steps are taken in world axes here, (dt_w, dphi_w) = (R dt, R dphi) with the (dt, dphi) of se3.h: a
// landmark's derivative by a pose is then that of its world point times (rho I, -[y]x), y = xyz - rho t.
// It needs no rotation a measurement; host and target differ in sign only.
#pragma once

#include <cstddef>
#include <vector>

#include "slam/solver/bundle_problem.h"

namespace farpoint::slam {

using Matrix26d = Eigen::Matrix<double, 2, 6>;
using Matrix36d = Eigen::Matrix<double, 3, 6>;

// d(xyz) by the pose that carries the point.
[[nodiscard]] inline Matrix36d carry(const BundleFrames::WorldPoint& point,
                                     const Eigen::Vector3d& t_world_body) {
  Matrix36d d;
  d.leftCols<3>() = point.inverse_depth * Eigen::Matrix3d::Identity();
  d.rightCols<3>() = -skew(point.xyz - point.inverse_depth * t_world_body);
  return d;
}

// scale * d_xyz * carry(point, t), without the multiplications by zero.
[[nodiscard]] inline Matrix26d carried(const Matrix23d& d_xyz, double scale,
                                       const BundleFrames::WorldPoint& point,
                                       const Eigen::Vector3d& t_world_body) {
  const Eigen::Vector3d y = point.xyz - point.inverse_depth * t_world_body;
  const Matrix23d d = scale * d_xyz;
  Matrix26d J;
  J.leftCols<3>() = point.inverse_depth * d;
  J.col(3) = d.col(2) * y.y() - d.col(1) * y.z();
  J.col(4) = d.col(0) * y.z() - d.col(2) * y.x();
  J.col(5) = d.col(1) * y.x() - d.col(0) * y.y();
  return J;
}

// Symmetric matrix of 6x6 blocks, upper triangle, each block in one piece of memory: the rank-one updates of
// the Schur complement are most of the work, and stay within few cache lines.
class BlockMatrix {
 public:
  void resize(int blocks) {
    blocks_ = blocks;
    data_.resize(static_cast<std::size_t>(blocks * (blocks + 1) / 2));
  }
  void set_zero() {
    for (Matrix6d& b : data_) b.setZero();
  }
  // row <= column
  [[nodiscard]] Matrix6d& at(int row, int column) { return data_[index(row, column)]; }

  // Upper triangle of `out`; the rest is untouched.
  void copy_to(Eigen::MatrixXd* out) const {
    for (int r = 0; r < blocks_; ++r)
      for (int c = r; c < blocks_; ++c) out->block<6, 6>(6 * r, 6 * c) = data_[index(r, c)];
  }

 private:
  [[nodiscard]] std::size_t index(int row, int column) const {
    const int i = column * (column + 1) / 2 + row;
    return static_cast<std::size_t>(i);
  }
  int blocks_ = 0;
  std::vector<Matrix6d> data_;
};

}  // namespace farpoint::slam
