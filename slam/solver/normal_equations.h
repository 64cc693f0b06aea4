// SPDX-License-Identifier: Apache-2.0
// The normal equations of poses, motions and globals: where each state stands in them, and their sums.
//
// Pose steps are in world axes, as schur_blocks.h says. Motions and globals stand behind all poses.
#pragma once

#include <span>
#include <vector>

#include "slam/solver/factor.h"
#include "slam/solver/schur_blocks.h"

namespace farpoint::slam {

// Where each state stands. Free poses come first, 6 entries each, then free motions, then free globals.
class StateLayout {
 public:
  void update(const StateWindow& states);

  // Index among the free poses; -1 where the pose is fixed.
  [[nodiscard]] int free_index(int pose) const { return pose_index_[static_cast<std::size_t>(pose)]; }
  // The free poses, ascending.
  [[nodiscard]] const std::vector<std::size_t>& free_poses() const { return free_poses_; }
  // First entry of the state; -1 where it is fixed.
  [[nodiscard]] int offset(StateBlock block) const;

  // Entries of all free poses, and of everything.
  [[nodiscard]] int pose_entries() const { return 6 * static_cast<int>(free_poses_.size()); }
  [[nodiscard]] int entries() const { return entries_; }

 private:
  std::vector<int> pose_index_, motion_offset_, global_offset_;
  std::vector<std::size_t> free_poses_;
  int entries_ = 0;
};

// Hessian and gradient. Factors add to them here, landmarks in the Schur solver.
struct NormalEquations {
  BlockMatrix poses;
  // Columns of motions and globals over all rows; only the part on and above the diagonal holds values.
  Eigen::MatrixXd rest;
  Eigen::VectorXd gradient;

  void resize(const StateLayout& layout);
  void set_zero();
  // Adds a factor, linearised at `states`.
  void add(const StateFactor& factor, const StateWindow& states, const StateLayout& layout);
  // Levenberg-Marquardt: grows the diagonal.
  void damp(double lambda);
  // Upper triangle of `out`, which has the right size; the rest is untouched.
  void copy_to(Eigen::MatrixXd* out) const;

 private:
  void add_block(int row, int column, const Eigen::Ref<const Eigen::MatrixXd>& block);
};

// Loss of one factor at `states`.
[[nodiscard]] double cost(const StateFactor& factor, const StateWindow& states);

}  // namespace farpoint::slam
