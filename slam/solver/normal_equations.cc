// SPDX-License-Identifier: Apache-2.0
#include "slam/solver/normal_equations.h"

#include <algorithm>

#include "slam/geometry/robust.h"

namespace farpoint::slam {

namespace {

struct Linearised {
  FactorResidual r;
  FactorJacobian J;
};

Linearised linearised(const StateFactor& factor, const StateWindow& states) {
  Linearised out;
  out.r.setZero(factor.residuals());
  out.J.setZero(factor.residuals(), columns(factor, states));
  factor.evaluate(states, &out.r, &out.J);
  return out;
}

// From a perturbation in body axes to a step in world axes: d(r)/d(step) = d(r)/d(perturbation) R'.
void turn_to_world_axes(const StateFactor& factor, const StateWindow& states, FactorJacobian* J) {
  int first = 0;
  for (const StateBlock block : factor.blocks()) {
    if (block.kind == StateBlock::Kind::kPose) {
      const Eigen::Matrix3d R_body_world = states.T_world_body(block.index).rotation().transpose();
      for (const int part : {first, first + 3}) {
        const Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMaxFactorResiduals, 3> by_body =
            J->middleCols<3>(part);
        J->middleCols<3>(part).noalias() = by_body * R_body_world;
      }
    }
    first += states.size(block);
  }
}

}  // namespace

void StateLayout::update(const StateWindow& states) {
  pose_index_.assign(states.poses.size(), -1);
  free_poses_.clear();
  for (std::size_t i = 0; i < states.poses.size(); ++i)
    if (!states.poses[i].fixed) {
      pose_index_[i] = static_cast<int>(free_poses_.size());
      free_poses_.push_back(i);
    }
  entries_ = pose_entries();
  const auto place = [this](bool fixed, int size) {
    if (fixed) return -1;
    const int at = entries_;
    entries_ += size;
    return at;
  };
  motion_offset_.clear();
  for (const MotionState& m : states.motions) motion_offset_.push_back(place(m.fixed, MotionState::kSize));
  global_offset_.clear();
  for (const GlobalState& g : states.globals) global_offset_.push_back(place(g.fixed, g.size()));
}

int StateLayout::offset(StateBlock block) const {
  const auto i = static_cast<std::size_t>(block.index);
  switch (block.kind) {
    case StateBlock::Kind::kPose:
      return pose_index_[i] < 0 ? -1 : 6 * pose_index_[i];
    case StateBlock::Kind::kMotion:
      return motion_offset_[i];
    case StateBlock::Kind::kGlobal:
      break;
  }
  return global_offset_[i];
}

void NormalEquations::resize(const StateLayout& layout) {
  poses.resize(static_cast<int>(layout.free_poses().size()));
  rest.resize(layout.entries(), layout.entries() - layout.pose_entries());
  gradient.resize(layout.entries());
}

void NormalEquations::set_zero() {
  poses.set_zero();
  rest.setZero();
  gradient.setZero();
}

void NormalEquations::add(const StateFactor& factor, const StateWindow& states, const StateLayout& layout) {
  Linearised lin = linearised(factor, states);
  turn_to_world_axes(factor, states, &lin.J);
  const double weight = huber_weight(lin.r.squaredNorm(), factor.huber_delta());
  int first_i = 0;
  for (const StateBlock i : factor.blocks()) {
    const int size_i = states.size(i), row = layout.offset(i);
    const auto J_i = lin.J.middleCols(first_i, size_i);
    first_i += size_i;
    if (row < 0) continue;
    gradient.segment(row, size_i) += weight * J_i.transpose() * lin.r;
    int first_j = 0;
    for (const StateBlock j : factor.blocks()) {
      const int size_j = states.size(j), column = layout.offset(j);
      if (column >= row) add_block(row, column, weight * J_i.transpose() * lin.J.middleCols(first_j, size_j));
      first_j += size_j;
    }
  }
}

void NormalEquations::add_block(int row, int column, const Eigen::Ref<const Eigen::MatrixXd>& block) {
  const int pose_entries = static_cast<int>(rest.rows() - rest.cols());
  if (column < pose_entries)
    poses.at(row / 6, column / 6) += block;
  else
    rest.block(row, column - pose_entries, block.rows(), block.cols()) += block;
}

void NormalEquations::damp(double lambda) {
  const auto grow = [lambda](double& d) { d += lambda * std::clamp(d, 1e-6, 1e32); };
  const auto pose_entries = rest.rows() - rest.cols();
  for (int i = 0; i < static_cast<int>(pose_entries / 6); ++i)
    for (int k = 0; k < 6; ++k) grow(poses.at(i, i)(k, k));
  for (Eigen::Index k = 0; k < rest.cols(); ++k) grow(rest(pose_entries + k, k));
}

void NormalEquations::copy_to(Eigen::MatrixXd* out) const {
  poses.copy_to(out);
  out->rightCols(rest.cols()) = rest;
}

double cost(const StateFactor& factor, const StateWindow& states) {
  FactorResidual r;
  r.setZero(factor.residuals());
  factor.evaluate(states, &r, nullptr);
  return huber_cost(r.squaredNorm(), factor.huber_delta());
}

}  // namespace farpoint::slam
